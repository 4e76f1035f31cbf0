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
#include "waymark/base/stage_times.h"
#include "waymark/camera/calibration.h"
#include "waymark/features/features.h"
#include "waymark/image/image.h"
#include "waymark/map/align.h"
#include "waymark/map/map.h"
#include "waymark/map/messages.h"
#include "waymark/mapfile/map_file.h"

// What travels between the session's thread and the viewer's. Values only; what is shared is
// immutable.
namespace waymark {

/// A frame of the trajectory and of the time line.
struct FrameSummary : FrameStatus {
  FrameId frame;                          ///< Which one.
  std::int64_t timestamp_ns = 0;          ///< Of the input.
  float tracking_ms = 0.0f;               ///< From image in memory to pose.
  std::optional<RelativePose> pose;       ///< Moves with the map.
  std::optional<Rigid3> final_pose = {};  ///< world_from_rig, in place of it.
};

/// Colours at the features of a frame, for the landmarks that will be made from them.
struct FeatureColors {
  FrameId frame;                                 ///< Which one.
  std::vector<std::array<std::uint8_t, 3>> rgb;  ///< Per primary feature.
};

/// What is drawn of the newest frame.
struct DrawnFrame {
  FrameId frame;                  ///< Which one.
  std::int64_t timestamp_ns = 0;  ///< Of the input.
  int width_px = 0;               ///< Of the images of camera 0, whether there is one or not.
  int height_px = 0;              ///< The same.
  std::shared_ptr<const Features> features;  ///< May be null.
  std::vector<LandmarkId> landmarks;         ///< Per feature, invalid where none; or empty.
  Image image;                               ///< Empty: no image this time.
};

/// What a session is; it does not change while there are frames.
struct SessionInfo {
  std::string program;    ///< With version.
  bool is_live = true;    ///< False for a saved map.
  std::string input;      ///< What is mapped, for people.
  std::string setup;      ///< "mono", "stereo" or "rgbd"; empty: not known yet.
  std::string timing;     ///< "inline", "lockstep" or "realtime".
  bool can_save = false;  ///< Whether there is where to save the map.
  /// Whether a saved map may be written with other lengths.
  bool can_scale = false;
  bool keeps_images = false;  ///< Whether images of keyframes are there to be seen.
};

/// Where a session is in its course; kMap: there is none, a saved map is shown.
enum class SessionPhase { kStarting, kRunning, kPaused, kFinishing, kDone, kMap };

/// What an IMU measures beside the camera, and tells of the map.
struct ImuStatus {
  std::optional<double> rate_hz = {};  ///< Samples per second; nothing: none are taken.
  bool is_used = false;                ///< Whether vision agrees with it.
  std::string reason = {};             ///< Why it is not used; empty: not compared yet.
  /// Where it points to in the frame of `submap`, unit.
  std::optional<Eigen::Vector3d> gravity = {};
  SubmapId submap = {};  ///< The part of the map that it was compared with.
  /// The part of the map that is in metres since it told these, whatever its Submap says.
  SubmapId metric_submap = {};
  /// Of the newest frame, in m/s in the frame of its part of the map; nothing where that has no
  /// metres.
  std::optional<Eigen::Vector3d> velocity_m_s = {};
};

/// Numbers of the session, as the status message has them.
struct SessionStatus {
  SessionPhase phase = SessionPhase::kStarting;  ///< Where the session is in its course.
  std::string doing;                             ///< What is done before there is one; or empty.
  bool is_mapping = true;                        ///< Whether the map grows.
  std::optional<FrameId> frame;                  ///< The newest.
  double time_s = 0.0;                           ///< Of the newest frame, since the first.
  FrameStatus newest = {.state = FrameState::kInitializing};  ///< Of the newest frame.
  StageTimes stages;                                          ///< Of the newest frame.
  double median_tracking_ms = 0.0;                            ///< Of the recent frames.
  std::size_t num_frames = 0;                                 ///< So far.
  std::optional<std::size_t> num_frames_total;                ///< Of the input, if it is known.
  std::size_t num_tracked = 0;                                ///< Frames with a pose.
  std::size_t num_unreadable = 0;                ///< Frames whose images could not be used.
  std::size_t num_dropped = 0;                   ///< Frames that came too late.
  std::size_t lost_count = 0;                    ///< Transitions to lost.
  double frames_per_s = 0.0;                     ///< Of the recent frames.
  std::vector<CalibrationEstimate> calibration;  ///< What the images changed of it.
  std::optional<ImuStatus> imu;                  ///< Nothing: the session has none.
};

/// What changed in the session since the update before.
struct ViewUpdate {
  bool is_reset = false;                    ///< Everything before is void.
  std::optional<SessionInfo> info = {};     ///< Known better than it was before.
  std::shared_ptr<const Map> map;           ///< Null: as before.
  std::vector<FrameSummary> frames;         ///< New ones and those that are known better now.
  std::vector<FeatureColors> colors;        ///< Of new frames.
  std::shared_ptr<const DrawnFrame> image;  ///< Null: none this time.
  SessionStatus status;                     ///< As of now.
  KeyframeImages keyframe_images = {};      ///< Of a saved map.
};

/// What a viewer asks of the session.
struct ViewRequest {
  /// Stop ends the session, save writes the map; image wants that of a keyframe, scale wants a
  /// saved map written with the lengths that a distance gives it.
  enum class Kind {
    kPause,
    kResume,
    kReset,
    kSave,
    kMappingOn,
    kMappingOff,
    kStop,
    kImage,
    kScale
  };
  Kind kind = Kind::kPause;                    ///< What is asked for.
  std::uint64_t client = 0;                    ///< Whom to answer.
  std::uint64_t number = 0;                    ///< The client's.
  KeyframeId keyframe = {};                    ///< Whose image.
  std::optional<KnownDistance> distance = {};  ///< To scale by.
};

/// The answer to a request that takes time.
struct ViewReply {
  ViewRequest request;  ///< What is answered.
  std::string path;     ///< Of what was saved.
  std::string error;    ///< Empty if all went well.
  /// The image that was asked for; null where there is none.
  std::shared_ptr<const std::string> jpeg = nullptr;
};

}  // namespace waymark
