// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/image/features.h"
#include "waymark/image/image.h"
#include "waymark/map/map.h"
#include "waymark/track/messages.h"
#include "waymark/track/stage_times.h"

/// What travels between the session's thread and the viewer's. Values only; what is shared is
/// immutable.
namespace waymark {

/// A frame of the trajectory and of the time line.
struct FrameNote {
  FrameId frame;
  std::int64_t timestamp_ns = 0;
  FrameState state = FrameState::kLost;
  FrameReason reason = FrameReason::kNone;
  float tracking_ms = 0.0f;
  std::optional<RelativePose> pose;       ///< Moves with the map.
  std::optional<Rigid3> final_pose = {};  ///< world_from_rig, in place of it.
  SubmapId submap;
};

/// Colours at the features of a frame, for the landmarks that will be made from them.
struct FeatureColors {
  FrameId frame;
  std::vector<std::array<std::uint8_t, 3>> rgb;  ///< Per primary feature.
};

/// What is drawn of the newest frame.
struct FrameImage {
  FrameId frame;
  std::int64_t timestamp_ns = 0;
  int width_px = 0;
  int height_px = 0;
  std::shared_ptr<const Features> features;
  std::vector<LandmarkId> landmarks;  ///< Per feature, invalid where none; or empty.
  Image image;                        ///< Empty: no image this time.
};

enum class SessionPhase { kStarting, kRunning, kPaused, kFinishing, kDone, kMap };

/// Numbers of the session, as the status message has them.
struct SessionStatus {
  SessionPhase phase = SessionPhase::kStarting;
  bool is_mapping = true;
  std::optional<FrameId> frame;  ///< The newest.
  double time_s = 0.0;
  FrameState state = FrameState::kInitializing;
  FrameReason reason = FrameReason::kNone;
  SubmapId submap;
  int num_matches = 0;
  int num_inliers = 0;
  StageTimes stages;
  double median_tracking_ms = 0.0;
  std::size_t num_frames = 0;
  std::optional<std::size_t> num_frames_total;
  std::size_t num_tracked = 0;
  std::size_t num_unreadable = 0;
  std::size_t num_dropped = 0;
  std::size_t lost_count = 0;
  double frames_per_s = 0.0;
};

/// What changed in the session since the update before.
struct ViewUpdate {
  bool is_reset = false;  ///< Everything before is void.
  std::shared_ptr<const Map> map;
  std::vector<FrameNote> frames;  ///< New ones and those that are known better now.
  std::vector<FeatureColors> colors;
  std::shared_ptr<const FrameImage> image;  ///< Null: none this time.
  SessionStatus status;
};

/// What a viewer asks of the session.
struct ViewRequest {
  enum class Kind { kPause, kResume, kReset, kSave, kMappingOn, kMappingOff, kStop };
  Kind kind = Kind::kPause;
  std::uint64_t client = 0;  ///< Whom to answer.
  std::uint64_t number = 0;  ///< The client's.
};

/// The answer to a request that takes time.
struct ViewReply {
  ViewRequest request;
  std::string path;   ///< Of what was saved.
  std::string error;  ///< Empty if all went well.
};

/// What does not change during a session.
struct SessionInfo {
  std::string program;  ///< With version.
  bool is_live = true;  ///< False for a saved map.
  std::string input;
  std::string setup;
  std::string timing;
  bool can_save = false;
};

}  // namespace waymark
