// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "waymark/loop/adjustment_pace.h"
#include "waymark/loop/beside.h"
#include "waymark/loop/settings.h"
#include "waymark/loop/verify.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/mapping/mapper.h"
#include "waymark/mapping/markers.h"
#include "waymark/place/place_index.h"
#include "waymark/track/map_snapshot.h"

namespace waymark {

/// The sub-map that is to be adjusted as a whole, as it was when that was decided. Immutable.
struct AdjustmentTask {
  std::shared_ptr<const Map> map;
  SubmapId submap;
  std::uint32_t num_closures = 0;    ///< Loops closed and sub-maps joined before.
  std::uint32_t num_placements = 0;  ///< Sub-maps moved by their markers, loops undone before.
  /// What is to be adjusted along, if anything.
  std::optional<KnownCalibration> calibration = std::nullopt;
  bool is_for_calibration = false;  ///< Without a new calibration nothing is to change.

  /// Does it.
  GlobalAdjustment adjust() const;
};

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
  /// The adjustment that a loop made necessary, see AdjustmentPace, or that may tell the
  /// calibration; nothing where there is none.
  std::optional<AdjustmentTask> take_task();
  /// Whether there is one that a loop made necessary.
  bool has_loop_task() const {
    return unadjusted_.is_valid() && pace_.is_due(mapper_.map().keyframes().size());
  }
  /// See Mapper.
  void set_motion(KeyframeId id, const RigMotion& motion) { mapper_.set_motion(id, motion); }
  /// Takes in what a task gave, carried over where a loop was closed meanwhile, or not at all where
  /// the map was moved by its markers or a loop undone: then a new task follows.
  void apply(const AdjustmentTask& task, const GlobalAdjustment& adjustment);
  /// The end: looks for loops a last time and consolidates.
  void finish();
  /// Drops the landmarks on what is gone (see find_seen_through()), for the end: the poses stay.
  void drop_seen_through() { mapper_.drop_seen_through(); }

  /// Finds what looks like a keyframe, verifies and closes it; whether there was something.
  bool close_alike(KeyframeId query);
  /// Closes a loop, unless those so far contradict it, or joins two sub-maps. Loops that it
  /// contradicts together with others are undone. Whether it was closed.
  bool close(const Revisit& revisit);
  /// See join_by_markers(); whether there was something to join.
  bool join_what_knows_the_same_markers();
  /// A closure brings parts of the map together that may touch elsewhere, too: adjusts every
  /// sub-map, closes what lies beside each other, fuses overlaps and adjusts again.
  void consolidate();

  const Map& map() const { return mapper_.map(); }
  const KnownCalibration& calibration() const { return mapper_.calibration(); }
  MapSnapshot snapshot();
  int num_loops() const { return num_loops_; }
  /// Of the sub-map with most keyframes, as surveyed last; empty where no markers are looked for.
  const MarkerSurvey& marker_survey() const { return marker_survey_; }
  int num_joins() const { return num_joins_; }

 private:
  void update_places(const Mapper::Changes& changes);
  bool close_one_beside(KeyframeId query, std::span<const KeyframeId> beside);
  using Moved = std::vector<KeyframeId>;  ///< By a loop or a join, ascending.

  std::optional<Moved> close_moving(const Revisit& revisit);
  std::optional<Moved> close_loop(const Revisit& revisit);
  Moved join(const Revisit& revisit);
  bool agrees_with_loops(const Revisit& revisit);
  void undo(SubmapId submap, std::span<const std::uint8_t> is_on, std::span<const LoopEdge> also);
  void disbelieve(const LoopEdge& loop);
  void note_odometry();
  void adjust_soon(SubmapId submap);
  void consolidate_some(std::size_t max_count);
  void consolidate_rest();
  std::vector<KeyframeId> all_keyframes() const;
  void consolidate_later(std::span<const KeyframeId> keyframes);
  std::optional<KeyframeId> next_unconsolidated();
  void look_with_calibration(const std::shared_ptr<const Rig>& before);
  void refine_globally(bool with_calibration);
  void look_at_markers(KeyframeId newest);
  void place_rest_by_markers();

  const LoopSettings settings_;
  const std::uint64_t seed_;
  std::size_t next_calibration_;  ///< Keyframes of the map when the calibration is due again.
  Mapper mapper_;
  PlaceIndex places_;
  RevisitVerifier verifier_;
  ProjectionMatcher projection_;
  AdjustmentPace pace_;
  SubmapId unadjusted_;  ///< Whose loops are closed by a pose graph only; invalid if none.
  std::set<KeyframeId> unconsolidated_;  ///< To be compared with what lies beside, last first.
  KeyframeId end_of_noted_{0};           ///< Keyframes below were among these at some time.
  KeyframeId end_of_odometry_{0};        ///< Keyframes below are noted in the map's.
  SnapshotsInUse in_use_;
  LivePositions positions_;
  /// Loops that others contradict, in units before any correction: further ones may agree with
  /// them.
  std::vector<LoopEdge> disbelieved_;
  std::uint32_t num_closures_ = 0;
  int num_loops_ = 0;
  int num_joins_ = 0;
  const std::optional<KnownMarkers> known_markers_;  ///< Nothing: none are looked for.
  MarkerSurvey marker_survey_;
  std::map<SubmapId, MarkerFrame::Basis> placed_;  ///< Sub-maps that are in a frame of markers.
  std::uint32_t num_placements_ = 0;
  std::size_t next_survey_;  ///< Keyframes of a sub-map with markers when it is due again.
};

}  // namespace waymark
