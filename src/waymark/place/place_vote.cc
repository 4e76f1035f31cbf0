// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "waymark/place/place_segment.h"

namespace waymark {
namespace {

// Descriptors that are looked at per table.
constexpr std::size_t kNumNeighbours = 32;
// Bits in which the keys of one thing seen twice may differ.
constexpr int kMaxDistance = 8;
// The least that is read of a segment, which may hold more of the neighbours than its share.
constexpr std::size_t kMinWindow = 8;

static_assert(kNumNeighbours <= PlaceSegment::kMaxWindow);

/// Bits set in a word (Warren, Hacker's Delight, section 5-1); the baseline of x86-64 has no
/// instruction for it, and std::popcount makes a call of it.
int count_bits(std::uint64_t word) {
  word -= (word >> 1) & 0x5555555555555555u;
  word = (word & 0x3333333333333333u) + ((word >> 2) & 0x3333333333333333u);
  word = (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0fu;
  return static_cast<int>((word * 0x0101010101010101u) >> 56);
}

/// Counts votes, at most one per descriptor and row.
class Ballot {
 public:
  explicit Ballot(std::size_t num_rows) : scores_(num_rows), voter_(num_rows, UINT32_MAX) {}

  void vote(std::uint32_t descriptor, std::size_t row) {
    if (voter_[row] == descriptor) return;
    voter_[row] = descriptor;
    voted_.push_back(row);
  }

  /// Ends the votes of one descriptor.
  void close() {
    if (voted_.empty()) return;
    const auto num_rows = static_cast<double>(scores_.size());
    const double weight = std::log1p(num_rows / static_cast<double>(voted_.size()));
    for (const std::size_t row : voted_) scores_[row] += weight;
    voted_.clear();
  }

  std::vector<double> take_scores(std::size_t num_descriptors) {
    const double most =
        static_cast<double>(num_descriptors) * std::log1p(static_cast<double>(scores_.size()));
    for (double& score : scores_) score /= most;
    return std::move(scores_);
  }

 private:
  std::vector<double> scores_;
  std::vector<std::uint32_t> voter_;  // The last descriptor that voted for a row.
  std::vector<std::size_t> voted_;    // The rows of the current descriptor.
};

/// The surroundings of a key in one table of all segments.
class Neighbourhood {
 public:
  explicit Neighbourhood(std::span<const std::shared_ptr<const PlaceSegment>> segments)
      : segments_(segments), parts_(segments.size()) {
    for (const auto& segment : segments) num_rows_ += segment->rows().size();
    std::size_t first_row = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const std::size_t num_rows = segments[i]->rows().size();
      const std::size_t share = 2 * kNumNeighbours * num_rows / num_rows_;
      parts_[i].window = std::clamp(share, kMinWindow, kNumNeighbours);
      parts_[i].first_row = first_row;
      first_row += num_rows;
    }
  }

  std::size_t num_rows() const { return num_rows_; }

  /// See PlaceSegment.
  void fetch_directories(std::size_t table, PlaceKey key) const {
    for (const auto& segment : segments_) segment->fetch_directory(table, key);
  }
  void fetch_entries(std::size_t table, PlaceKey key) const {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      segments_[i]->fetch_entries(table, key, parts_[i].window);
    }
  }

  void look(std::size_t table, PlaceKey key) {
    num_with_prefix_.fill(0);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      Part& part = parts_[i];
      part.num_near = segments_[i]->look_around(table, key, part.window, part.near);
      for (std::size_t k = 0; k < part.num_near; ++k) {
        ++num_with_prefix_[common_prefix(part.near[k])];
      }
    }
  }

  /// Calls visit(row) for the neighbours whose keys differ little.
  template <class Visitor>
  void visit_similar(Visitor&& visit) const {
    const std::size_t prefix = shortest_prefix();
    for (const Part& part : parts_) {
      for (std::size_t k = 0; k < part.num_near; ++k) {
        const PlaceDifference difference = part.near[k];
        if (common_prefix(difference) < prefix) continue;
        if (count_bits(difference & ~kPlaceRowMask) > kMaxDistance) continue;
        visit(part.first_row + (difference & kPlaceRowMask));
      }
    }
  }

 private:
  struct Part {
    std::size_t window = 0;
    std::size_t first_row = 0;
    std::size_t num_near = 0;
    PlaceSegment::Window near;
  };

  static std::size_t common_prefix(PlaceDifference difference) {
    return static_cast<std::size_t>(std::countl_zero(difference | kPlaceRowMask));
  }

  /// Not more than kNumNeighbours have it, unless more have the longest of all.
  std::size_t shortest_prefix() const {
    std::size_t prefix = num_with_prefix_.size();
    std::size_t count = 0;
    while (prefix > 0) {
      const std::size_t next = num_with_prefix_[prefix - 1];
      if (count > 0 && count + next > kNumNeighbours) break;
      count += next;
      --prefix;
    }
    return prefix;
  }

  std::span<const std::shared_ptr<const PlaceSegment>> segments_;
  std::vector<Part> parts_;
  std::array<std::uint32_t, kPlaceKeyBits + 1> num_with_prefix_ = {};
  std::size_t num_rows_ = 0;
};

}  // namespace

std::vector<double> vote_for_places(std::span<const std::shared_ptr<const PlaceSegment>> segments,
                                    std::span<const Descriptor> descriptors) {
  Neighbourhood neighbourhood(segments);
  Ballot ballot(neighbourhood.num_rows());
  std::vector<PlaceKey> keys;  // Of all tables, descriptor by descriptor.
  keys.reserve(kNumPlaceTables * descriptors.size());
  for (const Descriptor& descriptor : descriptors) {
    for (const PlaceKey key : place_keys(descriptor)) keys.push_back(key);
  }
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i + 2 < keys.size()) {
      neighbourhood.fetch_directories((i + 2) % kNumPlaceTables, keys[i + 2]);
    }
    if (i + 1 < keys.size()) neighbourhood.fetch_entries((i + 1) % kNumPlaceTables, keys[i + 1]);
    neighbourhood.look(i % kNumPlaceTables, keys[i]);
    const auto descriptor = static_cast<std::uint32_t>(i / kNumPlaceTables);
    neighbourhood.visit_similar([&](std::size_t row) { ballot.vote(descriptor, row); });
    if (i % kNumPlaceTables + 1 == kNumPlaceTables) ballot.close();
  }
  return ballot.take_scores(descriptors.size());
}

}  // namespace waymark
