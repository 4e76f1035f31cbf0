// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <memory_resource>
#include <span>
#include <utility>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/features/features.h"
#include "waymark/place/place_segment.h"

namespace waymark {

/// A keyframe that may show the same place.
struct PlaceCandidate {
  KeyframeId keyframe;
  SubmapId submap;
  /// 0 to 1: how much of the query is found again in this keyframe, what few keyframes show
  /// counting more (Sparck Jones 1972). Compare within one query only.
  double score = 0.0;
};

/// Which candidates are wanted.
struct PlaceQuery {
  std::size_t max_candidates = 10;
  /// Keyframes that are not wanted, such as the query's own surroundings; may be empty.
  std::function<bool(const PlaceRow&)> is_excluded = {};
};

/// Finds the keyframes of all sub-maps that look like an image, from nothing but the descriptors of
/// the map. See vote_for_places() for how.
///
/// A value: its segments never change and are shared by its copies, so that a copy takes
/// microseconds and stays as it is while the original goes on. The same calls in the same order
/// give the same index and the same candidates. Costs some 33 kB per keyframe of 1000 features.
/// Thread safety: copies are independent; any number of threads may query one index.
class PlaceIndex {
 public:
  /// Tables that are made from now on lie in this memory, but for those of the youngest keyframes;
  /// null: on the heap.
  void keep_tables_in(std::shared_ptr<std::pmr::memory_resource> memory) {
    memory_ = std::move(memory);
  }

  /// Adds a keyframe; ids must ascend. Now and then merges segments, which takes some nanoseconds
  /// per descriptor of each.
  void add(KeyframeId keyframe, SubmapId submap, std::span<const Descriptor> descriptors);

  /// The keyframe is found no longer; false if it was not there. Its descriptors go when its
  /// segment is next merged, at the latest when half of the segment is erased.
  bool erase(KeyframeId keyframe);

  /// The keyframes of one sub-map, also those added later, belong to another one from now on.
  void join(SubmapId from, SubmapId into);

  /// The best candidates, best first; of equal ones the older first.
  std::vector<PlaceCandidate> find(std::span<const Descriptor> descriptors,
                                   const PlaceQuery& query) const;

  bool contains(KeyframeId keyframe) const;
  std::size_t size() const { return num_rows_ - erased_.size(); }
  std::size_t num_segments() const { return segments_.size(); }
  std::size_t num_bytes() const;

 private:
  struct Join {
    SubmapId from;
    SubmapId into;
  };

  bool is_erased(KeyframeId keyframe) const;
  SubmapId resolve(SubmapId submap) const;
  std::size_t find_segment(KeyframeId keyframe) const;
  /// Of the keyframes that a segment still holds.
  std::span<const KeyframeId> erased_in(const PlaceSegment& segment) const;
  void merge_last_two();
  /// Makes the segment anew without its erased keyframes.
  void compact(std::size_t segment);
  /// Forgets about the erased keyframes of a segment that is about to be made anew without them.
  void forget_erased(const PlaceSegment& segment);

  std::shared_ptr<const PlaceSegment> merged(const PlaceSegment& a, const PlaceSegment& b) const;

  std::shared_ptr<std::pmr::memory_resource> memory_;
  std::vector<std::shared_ptr<const PlaceSegment>> segments_;  // Older first.
  std::vector<KeyframeId> erased_;  // Ascending; those that segments still hold.
  std::vector<Join> joins_;         // In the order they happened.
  std::size_t num_rows_ = 0;        // Of all segments, with the erased.
};

}  // namespace waymark
