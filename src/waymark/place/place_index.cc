// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/place/place_index.h"

#include <algorithm>

#include "waymark/base/check.h"

namespace waymark {
namespace {

// The youngest segment is made anew with every keyframe until it has so many; full ones merge with
// their elder neighbours when those are less than twice as large. There are thus some log2(n / 32)
// segments, and a descriptor is merged some 16 + log2(n / 32) times in all (O'Neil et al. 1996).
constexpr std::size_t kFullRows = 32;

bool is_better(const PlaceCandidate& a, const PlaceCandidate& b) {
  return a.score != b.score ? a.score > b.score : a.keyframe < b.keyframe;
}

}  // namespace

void PlaceIndex::add(KeyframeId keyframe,
                     SubmapId submap,
                     std::span<const Descriptor> descriptors) {
  WAYMARK_CHECK(keyframe.is_valid());
  WAYMARK_CHECK(segments_.empty() || segments_.back()->rows().back().keyframe < keyframe);
  const bool has_open = !segments_.empty() && segments_.back()->rows().size() < kFullRows;
  segments_.push_back(std::make_shared<const PlaceSegment>(PlaceRow{keyframe, submap},
                                                           thin_descriptors(descriptors)));
  ++num_rows_;
  if (has_open) merge_last_two();
  while (segments_.size() > 1 && segments_.back()->rows().size() >= kFullRows) {
    const std::size_t younger = segments_.back()->rows().size();
    const std::size_t elder = segments_[segments_.size() - 2]->rows().size();
    if (elder >= 2 * younger || elder + younger > PlaceSegment::kMaxRows) break;
    merge_last_two();
  }
}

bool PlaceIndex::erase(KeyframeId keyframe) {
  if (!contains(keyframe)) return false;
  erased_.insert(std::lower_bound(erased_.begin(), erased_.end(), keyframe), keyframe);
  const std::size_t segment = find_segment(keyframe);
  if (2 * erased_in(*segments_[segment]).size() >= segments_[segment]->rows().size())
    compact(segment);
  return true;
}

void PlaceIndex::join(SubmapId from, SubmapId into) {
  const Join join = {from, resolve(into)};
  WAYMARK_CHECK(join.into != from);
  joins_.push_back(join);
}

std::vector<PlaceCandidate> PlaceIndex::find(std::span<const Descriptor> descriptors,
                                             const PlaceQuery& query) const {
  if (descriptors.empty() || segments_.empty()) return {};
  const std::vector<double> scores = vote_for_places(segments_, thin_descriptors(descriptors));
  std::vector<PlaceCandidate> candidates;
  std::size_t next = 0;
  for (const auto& segment : segments_) {
    for (const PlaceRow& row : segment->rows()) {
      const double score = scores[next++];
      if (score <= 0.0 || is_erased(row.keyframe)) continue;
      const SubmapId submap = resolve(row.submap);
      if (query.is_excluded && query.is_excluded({row.keyframe, submap})) continue;
      candidates.push_back({row.keyframe, submap, score});
    }
  }
  const std::size_t count = std::min(query.max_candidates, candidates.size());
  const auto end = candidates.begin() + static_cast<std::ptrdiff_t>(count);
  std::partial_sort(candidates.begin(), end, candidates.end(), is_better);
  candidates.resize(count);
  return candidates;
}

bool PlaceIndex::contains(KeyframeId keyframe) const {
  const std::size_t segment = find_segment(keyframe);
  return segment < segments_.size() && !is_erased(keyframe) &&
         std::ranges::binary_search(segments_[segment]->rows(), keyframe, {}, &PlaceRow::keyframe);
}

std::size_t PlaceIndex::num_bytes() const {
  std::size_t bytes = erased_.capacity() * sizeof(KeyframeId) + joins_.capacity() * sizeof(Join);
  for (const auto& segment : segments_) bytes += segment->num_bytes();
  return bytes;
}

bool PlaceIndex::is_erased(KeyframeId keyframe) const {
  return std::binary_search(erased_.begin(), erased_.end(), keyframe);
}

SubmapId PlaceIndex::resolve(SubmapId submap) const {
  for (const Join& join : joins_) {
    if (submap == join.from) submap = join.into;
  }
  return submap;
}

std::size_t PlaceIndex::find_segment(KeyframeId keyframe) const {
  const auto segment = std::ranges::lower_bound(
      segments_, keyframe, {}, [](const auto& one) { return one->rows().back().keyframe; });
  return static_cast<std::size_t>(segment - segments_.begin());
}

std::span<const KeyframeId> PlaceIndex::erased_in(const PlaceSegment& segment) const {
  const std::span<const PlaceRow> rows = segment.rows();
  const auto begin = std::lower_bound(erased_.begin(), erased_.end(), rows.front().keyframe);
  return {begin, std::upper_bound(begin, erased_.end(), rows.back().keyframe)};
}

std::shared_ptr<const PlaceSegment> PlaceIndex::merged(const PlaceSegment& a,
                                                       const PlaceSegment& b) const {
  // What is made anew with every keyframe would be written to a disk in vain.
  const bool is_young = a.rows().size() + b.rows().size() < kFullRows;
  return std::make_shared<const PlaceSegment>(
      a,
      b,
      [this](KeyframeId keyframe) { return is_erased(keyframe); },
      is_young ? nullptr : memory_);
}

void PlaceIndex::merge_last_two() {
  const std::shared_ptr<const PlaceSegment> younger = segments_.back();
  segments_.pop_back();
  const std::shared_ptr<const PlaceSegment> elder = segments_.back();
  segments_.back() = merged(*elder, *younger);
  forget_erased(*elder);
  forget_erased(*younger);
}

void PlaceIndex::compact(std::size_t segment) {
  const std::shared_ptr<const PlaceSegment> old = segments_[segment];
  segments_[segment] = merged(*old, PlaceSegment());
  forget_erased(*old);
  if (segments_[segment]->rows().empty()) {
    segments_.erase(segments_.begin() + static_cast<std::ptrdiff_t>(segment));
  }
}

void PlaceIndex::forget_erased(const PlaceSegment& segment) {
  const std::span<const KeyframeId> gone = erased_in(segment);
  num_rows_ -= gone.size();
  const auto begin = erased_.begin() + (gone.data() - erased_.data());
  erased_.erase(begin, begin + std::ssize(gone));
}

}  // namespace waymark
