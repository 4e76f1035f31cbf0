// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "waymark/calibration/recalibrate.h"
#include "waymark/mapping/settings.h"
#include "waymark/track/frame.h"

namespace waymark {

/// What frames located in a map tell of the calibration of the cameras that took them. The map
/// stays as it is: what it shows of its landmarks, from poses that are fixed, holds these in place,
/// as firmly as they are known, while poses and calibration of the frames are adjusted.
class QueryCalibration {
 public:
  /// rig: as it is told, of the images that features are from.
  QueryCalibration(const std::shared_ptr<const Rig>& rig,
                   const CalibrationSettings& settings,
                   std::shared_ptr<const Map> map);

  /// Hears of a frame that was located, measured with known().rig. landmarks: per feature, invalid
  /// where none; those that the map has not are ignored. Whether the calibration changed, which is
  /// looked at after a fixed number of frames.
  bool add(const Frame& frame, const Rigid3& rig_from_world, std::span<const LandmarkId> landmarks);

  /// As far as the frames so far tell.
  const KnownCalibration& known() const { return known_; }

 private:
  void insert(const Frame& frame,
              const Rigid3& rig_from_world,
              std::span<const LandmarkId> landmarks);
  bool refine();

  std::shared_ptr<const Map> lasting_;
  KnownCalibration known_;
  Map map_;  ///< The one that stays, with the frames as keyframes.
  std::vector<KeyframeId> frames_;
  std::size_t next_look_;  ///< Frames when the calibration is looked at; 0: no more.
};

}  // namespace waymark
