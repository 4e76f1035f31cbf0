// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/loop/adjustment_schedule.h"
#include "waymark/loop/loop_history.h"
#include "waymark/loop/marker_placement.h"
#include "waymark/loop/settings.h"
#include "waymark/loop/spatial_neighbours.h"
#include "waymark/loop/unconsolidated.h"
#include "waymark/loop/verify.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/mapping/mapper.h"
#include "waymark/mapping/markers.h"
#include "waymark/place/map_snapshot.h"
#include "waymark/place/place_index.h"

namespace waymark {

/// The mapper with all that reaches beyond the surroundings of the newest keyframe: finds places
/// seen before, verifies and closes them at once, consolidates little by little, and has the rest
/// adjusted later by whoever runs the tasks it hands out.
class GlobalMapper {
 public:
  GlobalMapper(std::shared_ptr<const Rig> rig,
               const MappingSettings& mapping,
               const LoopSettings& loop,
               const CalibrationSettings& calibration,
               std::uint64_t seed,
               std::optional<KnownMarkers> markers = std::nullopt);

  /// Goes on with a map made before, by whatever cameras; before the first message.
  void take_over(const MapSnapshot& before);
  /// Keeps in this memory what only searching and joining need: the features and the index of
  /// places. After take_over().
  void keep_in(const std::shared_ptr<std::pmr::memory_resource>& memory);
  void add(const NewSubmap& message);
  void add(const NewKeyframe& message);
  /// Moves a part of the map.
  void place(const SubmapPlacement& placement);
  /// The adjustment that a loop made necessary, see AdjustmentInterval, or that may tell the
  /// calibration; nothing where there is none.
  std::optional<AdjustmentTask> take_task() { return schedule_.take(mapper_); }
  /// Whether there is one that a loop made necessary.
  bool has_loop_task() const { return schedule_.is_due(mapper_.map()); }
  /// See Mapper.
  void set_motion(KeyframeId id, const RigMotion& motion) { mapper_.set_motion(id, motion); }
  /// Takes in what a task gave, carried over where a loop was closed meanwhile, or not at all where
  /// the map was moved by its markers or a loop undone: then a new task follows.
  void apply(const AdjustmentTask& task, const GlobalAdjustment& adjustment);
  /// The end: looks for loops a last time and consolidates.
  void finish();

  /// Finds what looks like a keyframe, verifies and closes it; whether there was something.
  bool close_alike(KeyframeId query);
  /// Closes a loop, unless those so far contradict it, or joins two sub-maps. Loops that it
  /// contradicts together with others are undone. Whether it was closed.
  bool close(const LoopCandidate& candidate);
  /// See join_by_markers(); whether there was something to join.
  bool join_what_knows_the_same_markers();
  /// A closure brings parts of the map together that may touch elsewhere, too: adjusts every
  /// sub-map, closes what lies beside each other, fuses overlaps and adjusts again.
  void consolidate();

  const Map& map() const { return mapper_.map(); }
  const KnownCalibration& calibration() const { return mapper_.calibration(); }
  MapSnapshot snapshot();
  int num_loops() const { return history_.num_loops(); }
  /// Of the sub-map with most keyframes, as surveyed last; empty where no markers are looked for.
  const MarkerSurvey& marker_survey() const { return markers_.survey(); }
  int num_joins() const { return num_joins_; }
  /// The last part that was moved.
  const std::optional<SubmapPlacement>& placement() const { return placement_; }

 private:
  using Moved = std::vector<KeyframeId>;  ///< By a loop or a join, ascending.

  void update_places(const Mapper::Changes& changes);
  std::optional<Moved> close_moving(const LoopCandidate& candidate);
  std::optional<Moved> close_loop(const LoopCandidate& candidate);
  Moved join(const LoopCandidate& candidate);
  bool is_accepted(const LoopEdge& loop);
  bool close_with_neighbour(KeyframeId query, std::span<const KeyframeId> beside);
  void consolidate_some(std::size_t max_count);
  void consolidate_rest();
  std::vector<KeyframeId> all_keyframes() const;
  void refine_globally(bool with_calibration);

  const LoopSettings settings_;
  Mapper mapper_;
  PlaceIndex places_;
  LoopVerifier verifier_;
  ProjectionMatcher projection_;
  LoopHistory history_;
  AdjustmentSchedule schedule_;
  Unconsolidated unconsolidated_;
  LivePositions positions_;
  MarkerPlacement markers_;
  SnapshotsInUse in_use_;
  int num_joins_ = 0;
  std::optional<SubmapPlacement> placement_;
};

}  // namespace waymark
