// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/camera/tangent.h"
#include "waymark/map/map.h"
#include "waymark/match/projection.h"
#include "waymark/optimize/pose.h"

namespace waymark {

/// What a feature of camera 0 saw of a landmark, without the rest of the frame: its bearing follows
/// from that and the camera. Many are kept: small.
struct SeenLandmark {
  LandmarkId landmark;
  float x_px = 0.0f;  ///< Of level 0, as in Keypoint.
  float y_px = 0.0f;  ///< The same.
  /// Along z, in 1/m, by the depth image; ranges, and those from stereo all the more, would be
  /// measured with the calibration of then.
  float inverse_depth = 0.0f;
  float inverse_depth_sigma = 0.0f;  ///< Its standard deviation; 0 where there is none.
  std::uint8_t level = 0;            ///< Of the pyramid.
  bool is_edge = false;              ///< Seen across the edge only.
  std::int16_t across = 0;           ///< Keypoint::angle_rad there, in 1e-4 rad.
};

/// The features of a frame that show a landmark. landmarks: per feature, invalid where none.
std::vector<SeenLandmark> seen_landmarks(const Features& features,
                                         std::span<const LandmarkId> landmarks);

/// Finds the poses of past frames again, in a map that has changed since. A frame between keyframes
/// is known relative to one of them, and the map may have been a few percent too small or bent
/// where and when it was tracked; moving the frame with its keyframe does not mend that, locating
/// it anew does. rig: as calibrated by now. Keeps its buffers.
class PoseRefiner {
 public:
  /// Pose of a frame from what it saw of landmarks that still live, as the rig measures it; nothing
  /// if too few do, or too few agree on a pose near the given one.
  std::optional<Rigid3> refine(const Rig& rig,
                               const Map& map,
                               std::span<const SeenLandmark> seen,
                               const Rigid3& rig_from_world);

  /// The living of the same, moved to where a rolling shutter would have seen them had it read all
  /// rows at the time of the frame, by this motion there and this readout. rig_from_world: about
  /// the pose of the frame.
  std::vector<SeenLandmark> seen_at_once(const Rig& rig,
                                         const Map& map,
                                         std::span<const SeenLandmark> seen,
                                         const Rigid3& rig_from_world,
                                         const RigMotion& motion,
                                         float readout_s);

  /// What a frame near a keyframe sees of that keyframe's landmarks, given about its pose.
  std::vector<SeenLandmark> find(const Rig& rig,
                                 const Map& map,
                                 KeyframeId keyframe,
                                 const Features& features,
                                 const Rigid3& rig_from_world);

 private:
  const TangentArrays& linearize(const Rig& rig,
                                 const Map& map,
                                 std::span<const SeenLandmark> seen);
  void measure(const Rig& rig, const Map& map, std::span<const SeenLandmark> seen);

  ProjectionMatcher matcher_;
  TangentComputer tangents_;
  std::vector<const SeenLandmark*> living_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<float> level_scales_;
  PoseObservations observations_;
  PoseWorkspace workspace_;
};

}  // namespace waymark
