// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/place/place_segment.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/features/hamming.h"

namespace waymark {
namespace {

constexpr std::uint16_t kGone = UINT16_MAX;
// As many entries share a prefix of the directory on average.
constexpr int kEntriesPerPrefixLog2 = 4;

static_assert(kPlaceRowBits == 16);
static_assert(PlaceSegment::kMaxRows < kGone);

/// Appends the rows that stay to kept; gives where each went, or kGone.
std::vector<std::uint16_t> keep_rows(std::span<const PlaceRow> rows,
                                     const std::function<bool(KeyframeId)>& is_gone,
                                     std::vector<PlaceRow>& kept) {
  std::vector<std::uint16_t> targets;
  targets.reserve(rows.size());
  for (const PlaceRow& row : rows) {
    if (is_gone(row.keyframe)) {
      targets.push_back(kGone);
    } else {
      targets.push_back(static_cast<std::uint16_t>(kept.size()));
      kept.push_back(row);
    }
  }
  return targets;
}

/// Entries of one table and where their rows go.
struct MovingEntries {
  std::span<const std::uint64_t> entries;
  std::span<const std::uint16_t> targets;
};

/// The entries of rows that stay, under their new rows, in ascending order. The rows of b are above
/// those of a. Without branches that depend on the entries: which comes next cannot be predicted.
std::pmr::vector<std::uint64_t> merge_entries(const MovingEntries& a,
                                              const MovingEntries& b,
                                              std::pmr::memory_resource* memory) {
  std::pmr::vector<std::uint64_t> merged(a.entries.size() + b.entries.size(), memory);
  std::size_t count = 0;
  const auto put = [&](std::uint64_t entry, std::uint16_t target) {
    merged[count] = (entry & ~kPlaceRowMask) | target;
    count += target != kGone ? 1 : 0;
  };
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < a.entries.size() && k < b.entries.size()) {
    const std::uint64_t from_a = a.entries[i];
    const std::uint64_t from_b = b.entries[k];
    const bool is_b = (from_b | kPlaceRowMask) < (from_a | kPlaceRowMask);
    const std::uint64_t entry = is_b ? from_b : from_a;
    const std::uint16_t* const targets = is_b ? b.targets.data() : a.targets.data();
    put(entry, targets[entry & kPlaceRowMask]);
    i += is_b ? 0 : 1;
    k += is_b ? 1 : 0;
  }
  for (; i < a.entries.size(); ++i) put(a.entries[i], a.targets[a.entries[i] & kPlaceRowMask]);
  for (; k < b.entries.size(); ++k) put(b.entries[k], b.targets[b.entries[k] & kPlaceRowMask]);
  if (count < merged.size()) {
    merged.resize(count);
    merged.shrink_to_fit();
  }
  return merged;
}

static_assert(kNumPlaceTables * kPlaceKeyBits <= kDescriptorBits);

using BitOrder = std::array<std::uint8_t, kDescriptorBits>;

/// A shuffle of the bits of a descriptor (Fisher and Yates); consecutive runs of it make the keys.
BitOrder shuffled_bits() {
  BitOrder order;
  std::iota(order.begin(), order.end(), std::uint8_t{0});
  Rng rng(1, 0);
  for (std::uint32_t i = kDescriptorBits - 1; i > 0; --i) {
    std::swap(order[i], order[rng.below(i + 1)]);
  }
  return order;
}

}  // namespace

std::array<PlaceKey, kNumPlaceTables> place_keys(const Descriptor& descriptor) {
  static const BitOrder order = shuffled_bits();
  std::array<PlaceKey, kNumPlaceTables> keys = {};
  const std::uint8_t* bit = order.data();
  for (PlaceKey& key : keys) {
    for (int i = 0; i < kPlaceKeyBits; ++i, ++bit) {
      key = key << 1 | (descriptor[*bit / 64u] >> (*bit % 64u) & 1u);
    }
  }
  return keys;
}

PlaceSegment::PlaceSegment(const PlaceRow& row, std::span<const Descriptor> descriptors)
    : rows_{row}, tables_(kNumPlaceTables) {
  WAYMARK_CHECK(descriptors.size() <= kMaxDescriptors);
  for (Table& table : tables_) table.entries.reserve(descriptors.size());
  for (const Descriptor& descriptor : descriptors) {
    const std::array<PlaceKey, kNumPlaceTables> keys = place_keys(descriptor);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      tables_[i].entries.push_back(keys[i] << kPlaceRowBits);
    }
  }
  for (Table& table : tables_) {
    std::sort(table.entries.begin(), table.entries.end());
    table.index();
  }
}

PlaceSegment::PlaceSegment(const PlaceSegment& a,
                           const PlaceSegment& b,
                           const std::function<bool(KeyframeId)>& is_gone,
                           std::shared_ptr<std::pmr::memory_resource> memory)
    : memory_(std::move(memory)) {
  WAYMARK_CHECK(a.rows_.empty() || b.rows_.empty() ||
                a.rows_.back().keyframe < b.rows_.front().keyframe);
  const std::vector<std::uint16_t> targets_a = keep_rows(a.rows_, is_gone, rows_);
  const std::vector<std::uint16_t> targets_b = keep_rows(b.rows_, is_gone, rows_);
  WAYMARK_CHECK(rows_.size() <= kMaxRows);
  std::pmr::memory_resource* const place =
      memory_ ? memory_.get() : std::pmr::get_default_resource();
  tables_.reserve(kNumPlaceTables);
  for (std::size_t i = 0; i < kNumPlaceTables; ++i) {
    tables_.emplace_back(
        merge_entries({a.tables_[i].entries, targets_a}, {b.tables_[i].entries, targets_b}, place));
  }
}

PlaceSegment::Table::Table(std::pmr::vector<std::uint64_t> ascending)
    : entries(std::move(ascending)), directory(entries.get_allocator()) {
  index();
}

void PlaceSegment::Table::index() {
  WAYMARK_CHECK(entries.size() < UINT32_MAX);
  directory_bits =
      std::max(0, static_cast<int>(std::bit_width(entries.size())) - kEntriesPerPrefixLog2);
  const std::size_t num_prefixes = std::size_t{1} << directory_bits;
  directory.assign(num_prefixes + 1, static_cast<std::uint32_t>(entries.size()));
  std::size_t next = 0;
  for (std::size_t prefix = 0; prefix < num_prefixes && directory_bits > 0; ++prefix) {
    while (next < entries.size() && entries[next] >> (64 - directory_bits) < prefix) ++next;
    directory[prefix] = static_cast<std::uint32_t>(next);
  }
  if (directory_bits == 0) directory[0] = 0;
}

std::size_t PlaceSegment::Table::lower_bound(std::uint64_t entry) const {
  const std::size_t prefix = prefix_of(entry);
  const auto begin = entries.begin() + directory[prefix];
  const auto end = entries.begin() + directory[prefix + 1];
  return static_cast<std::size_t>(std::lower_bound(begin, end, entry) - entries.begin());
}

void PlaceSegment::Table::fetch_place(PlaceKey key) const {
  __builtin_prefetch(directory.data() + prefix_of(key << kPlaceRowBits));
}

void PlaceSegment::Table::fetch_around(PlaceKey key, std::size_t window) const {
  constexpr std::size_t kEntriesPerLine = 64 / sizeof(std::uint64_t);
  const std::size_t prefix = prefix_of(key << kPlaceRowBits);
  const std::size_t first = directory[prefix];
  const std::size_t begin = first - std::min(first, window / 2);
  const std::size_t end = std::min<std::size_t>(directory[prefix + 1] + window / 2, entries.size());
  for (std::size_t i = begin; i < end; i += kEntriesPerLine) __builtin_prefetch(&entries[i]);
}

std::size_t PlaceSegment::look_around(std::size_t table,
                                      PlaceKey key,
                                      std::size_t window,
                                      Window& differences) const {
  const std::pmr::vector<std::uint64_t>& entries = tables_[table].entries;
  const std::uint64_t entry = key << kPlaceRowBits;
  const std::size_t place = tables_[table].lower_bound(entry);
  const std::size_t count = std::min(window, entries.size());
  const std::size_t begin = std::min(place - std::min(place, window / 2), entries.size() - count);
  for (std::size_t i = 0; i < count; ++i) differences[i] = entries[begin + i] ^ entry;
  return count;
}

std::size_t PlaceSegment::num_bytes() const {
  std::size_t bytes = rows_.capacity() * sizeof(PlaceRow);
  for (const Table& table : tables_) {
    bytes += table.entries.capacity() * sizeof(std::uint64_t) +
             table.directory.capacity() * sizeof(std::uint32_t);
  }
  return bytes;
}

std::vector<Descriptor> thin_descriptors(std::span<const Descriptor> descriptors) {
  const std::size_t count = std::min(descriptors.size(), PlaceSegment::kMaxDescriptors);
  std::vector<Descriptor> kept;
  kept.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    kept.push_back(descriptors[i * descriptors.size() / count]);
  return kept;
}

}  // namespace waymark
