// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/map/messages.h"
#include "waymark/mapping/associate.h"
#include "waymark/mapping/cull.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/mapping/settings.h"
#include "waymark/match/epipolar.h"
#include "waymark/match/projection.h"

namespace waymark {

/// Owns the map and is its only writer: turns the tracker's messages into keyframes and landmarks
/// and keeps the surroundings of the newest keyframe consistent.
class Mapper {
 public:
  Mapper(std::shared_ptr<const Rig> rig,
         const MappingSettings& settings,
         const CalibrationSettings& calibration = {});

  /// Features, those that come in later, too, are copied into this memory.
  void keep_features_in(std::shared_ptr<std::pmr::memory_resource> memory);
  /// Goes on with a map made before, by whatever cameras; before the first message.
  void take_over(const Map& frozen) { map_ = Map::thaw(frozen); }

  /// What a message did to the keyframes.
  struct Changes {
    std::vector<KeyframeId> added;
    std::vector<KeyframeId> erased;
  };
  Changes add(const NewSubmap& message);
  Changes add(const NewKeyframe& message);
  /// Adjusts every sub-map as a whole, the largest of them with the calibration.
  void refine_globally(bool with_calibration);
  /// How the rig moved while it saw a keyframe, known better now.
  void set_motion(KeyframeId id, const RigMotion& motion);
  /// Takes in what adjusting a whole sub-map gave.
  void apply(const GlobalAdjustment& adjustment);

  /// For what reaches beyond the surroundings of the newest keyframe: change(map, dirty), which
  /// says what landmarks look different after it.
  template <class Change>
  void change(Change&& change) {
    change(map_, dirty_);
    map_.keep_features_in(feature_memory_);  // It may have been made anew.
    refresh_appearances();
  }

  std::shared_ptr<const Map> freeze() { return map_.freeze(); }
  const Map& map() const { return map_; }
  const KnownCalibration& calibration() const { return calibration_; }
  /// Whether the calibration may change: the settings let it, and there is something to estimate.
  bool is_calibrating() const { return is_calibrating_; }

 private:
  KeyframeId insert(const NewKeyframe& message);
  /// Puts in what was measured, by the calibration of now.
  void set_measurements(const std::shared_ptr<const Features>& features,
                        const std::shared_ptr<const MarkerObservations>& markers,
                        Keyframe& keyframe) const;
  void look_for_readout(KeyframeId newest);
  void set_calibration(const KnownCalibration& calibration);
  void refresh_appearances();

  const MappingSettings settings_;
  const bool is_calibrating_;
  KnownCalibration calibration_;
  std::shared_ptr<std::pmr::memory_resource> feature_memory_;  ///< Null: where they come from.
  Map map_;
  DirtyLandmarks dirty_;
  RecentLandmarks recent_landmarks_;
  ProjectionMatcher projection_;
  EpipolarMatcher epipolar_;
};

}  // namespace waymark
