// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/base/timing.h"
#include "waymark/camera/rig.h"
#include "waymark/image/image.h"
#include "waymark/map/map.h"
#include "waymark/mapping/focal_check.h"
#include "waymark/system/settings.h"
#include "waymark/track/messages.h"
#include "waymark/track/stage_times.h"

namespace waymark {

/// The images of one moment. Views are borrowed for the duration of the call.
struct FrameInput {
  std::int64_t timestamp_ns = 0;  ///< Increases from frame to frame.
  ImageView image0;               ///< Camera 0, grey, of the size its calibration states.
  ImageView image1;               ///< Camera 1 of a stereo rig; empty otherwise.
  DepthView depth;  ///< Depth along z registered to camera 0; empty where there is none.
  ImageView mask;   ///< Of camera 0; no features where it is 0. Empty: everything is used.
};

/// What is known of a frame right after it was fed.
struct TrackingResult {
  FrameId frame;                            ///< Of this session, from 0 on.
  FrameState state = FrameState::kLost;     ///< What became of it.
  FrameReason reason = FrameReason::kNone;  ///< Why there is no pose.
  std::optional<Rigid3> world_from_rig;     ///< The pose, in metres (map units for mono).
  /// Covariance of the pose for perturbations exp(xi) * rig_from_world, xi = (rho, phi) in (m,
  /// rad).
  Matrix6d covariance = Matrix6d::Zero();
  int num_matches = 0;       ///< Where there is no pose, of the place in the map that came closest.
  int num_inliers = 0;       ///< The same.
  int num_candidates = 0;    ///< Places in the map compared when all else had failed.
  bool is_keyframe = false;  ///< Whether it was sent to the map.
  SubmapId submap;           ///< Whose frame the pose is in.
  StageTimes stages;         ///< What it took.
};

/// More of the newest frame, for those who show it. Poses are by reference: they move as the map is
/// corrected, see Map::rig_from_world(); the reference may not be in the newest map yet.
struct FrameDetails {
  FrameId frame;  ///< As keyframes of the map have it: goes on from those of a map made before.
  std::shared_ptr<const Features> features;  ///< Null for a frame that could not be used.
  std::vector<LandmarkId> landmarks;  ///< Per feature, invalid where none; empty without a pose.
  RelativePose pose;                  ///< Where the frame has one.
  std::vector<FilledPose> filled;     ///< Earlier frames that have a pose now.
};

/// A frame in the final trajectory.
struct TrajectoryFrame {
  FrameId frame;                         ///< Of this session, from 0 on.
  std::int64_t timestamp_ns = 0;         ///< As it was fed.
  FrameState state = FrameState::kLost;  ///< kTracked or kFilled.
  SubmapId submap;                       ///< Whose frame the pose is in.
  Rigid3 world_from_rig;                 ///< In metres (map units for mono).
};

/// Totals of a session.
struct SystemStatistics {
  int num_keyframes = 0;           ///< Of the map at the end.
  int num_landmarks = 0;           ///< Of the map at the end.
  int num_submaps = 0;             ///< Those that were not joined.
  int num_loops = 0;               ///< Closed in the session.
  int num_relocalizations = 0;     ///< Of the session.
  std::vector<double> mapping_ms;  ///< One entry per keyframe.
};

/// Visual SLAM on a stream of frames. One thread feeds; mapping runs beside it unless the timing is
/// kInline. kInline and kLockstep give the same bits; kRealtime never waits for the mapper, but for
/// a new sub-map, without which there is nothing to track in.
class System {
 public:
  /// Throws InputError for a rig or settings that cannot work together.
  ///
  /// map: one made before, that is to be extended, by whatever cameras; a copy goes on. The camera
  /// is looked for in it; where it is not found, a new sub-map begins, which is joined once it is.
  System(Rig rig,
         const Settings& settings,
         Timing timing,
         std::shared_ptr<const Map> map = nullptr);
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  /// Tracks one frame; timestamps must increase. A map without scale takes no images with range:
  /// then the first frame throws InputError. Rethrows what failed in the mapper's thread.
  TrackingResult feed(const FrameInput& input);

  /// Of the frame fed last; empty before the first.
  const FrameDetails& details() const;

  /// Mapping off: the camera is followed in the map, which stays as it is. On at first.
  void set_mapping(bool is_on);

  /// Begins anew with an empty map; frames count from 0 again. Not after finish().
  void reset();

  /// Ends the input: waits for outstanding mapping, refines globally. No feed() afterwards;
  /// statistics() only afterwards.
  void finish();

  /// Every frame that has a pose, in order, with what is known now. After finish(): final.
  std::vector<TrajectoryFrame> trajectory() const;

  /// State of every frame fed so far, including those filled in after the fact.
  std::vector<FrameState> frame_states() const;

  /// What the residuals say of the calibration's focal length, once some 200 frames are mapped and
  /// where the motion tells; null before.
  const FocalCheck* focal_check() const;

  /// The newest finished map, immutable.
  std::shared_ptr<const Map> map() const;

  /// Totals; after finish() only.
  SystemStatistics statistics() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
