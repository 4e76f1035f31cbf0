// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/map/map.h"
#include "waymark/match/appearance.h"
#include "waymark/match/projection.h"
#include "waymark/track/frame.h"
#include "waymark/track/frame_locator.h"
#include "waymark/track/initializer.h"
#include "waymark/track/keyframe_decision.h"
#include "waymark/track/local_map.h"
#include "waymark/track/map_snapshot.h"
#include "waymark/track/messages.h"
#include "waymark/track/motion_model.h"
#include "waymark/track/pose_refiner.h"
#include "waymark/track/relocalizer.h"
#include "waymark/track/stage_times.h"

namespace waymark {

/// Whether frames are only located in a map or also extend it.
enum class TrackingPurpose { kMapping, kLocalizing };

/// What tracking a frame gave.
struct TrackOutcome {
  FrameState state = FrameState::kLost;
  FrameReason reason = FrameReason::kNone;
  std::optional<RelativePose> pose;
  Rigid3 rig_from_world;  ///< The pose as of now, where there is one.
  Matrix6d covariance = Matrix6d::Zero();
  int num_matches = 0;     ///< Where there is no pose, of the place that came closest.
  int num_inliers = 0;     ///< The same.
  int num_candidates = 0;  ///< Places compared when all else had failed.
  std::optional<MapperMessage> message;  ///< For the mapper; a frame with a message is a keyframe.
  std::optional<KeyframeId> keyframe;    ///< The id that the frame will have as a keyframe.
  std::vector<FilledPose> filled;        ///< Earlier frames that have a pose now.
  std::vector<SeenLandmark> seen;        ///< What the pose rests on.
  std::vector<LandmarkId> landmarks;     ///< Per feature, invalid where none; empty without pose.
  SubmapId submap;                       ///< Where there is a pose.
  bool is_relocalized = false;           ///< Found again after a loss.
};

/// Follows the camera through the map, frame by frame (Klein and Murray 2007; Mur-Artal et al.
/// 2015): predict, match to the last frame, match to the local map, decide on a keyframe. A lost
/// frame is looked for in every sub-map; if no place looks like it, it helps to start a new one.
/// Reads frozen maps, writes messages. The mapper must take the messages in order and give
/// keyframes and sub-maps consecutive ids; a new sub-map must show in the next frame.
class Tracker {
 public:
  Tracker(std::shared_ptr<const Rig> rig,
          bool has_range,
          const TrackingSettings& settings,
          std::uint64_t seed);

  /// Begins lost in a map made before, with or without the right to extend it; before the first
  /// frame. Ids go on from those of the map.
  void begin_in(const Map& map, TrackingPurpose purpose);

  /// Whether the map goes on growing, or stays as it is while the camera is followed in it.
  void set_purpose(TrackingPurpose purpose) { purpose_ = purpose; }

  /// Goes on between two frames with this purpose in a map that lacks what is newest of the one so
  /// far, or nothing. What is not in it is forgotten.
  void continue_in(const Map& map, TrackingPurpose purpose);

  /// visible: the newest map that this frame may see; empty before the first sub-map.
  TrackOutcome track(const Frame& frame, const MapSnapshot& visible, StageTimes& times);

 private:
  enum class Mode { kInitializing, kTracking, kLost };

  TrackOutcome initialize(const Frame& frame, StageTimes& times);
  /// The first pose of a new sub-map, if this frame completes one.
  std::optional<TrackOutcome> start_submap(const Frame& frame);
  TrackOutcome follow(const Frame& frame, StageTimes& times);
  std::optional<LocatedFrame> locate_near_last(const Frame& frame, StageTimes& times);
  /// Reads the last frame's pose and landmarks in the map of this frame.
  void carry_over();
  std::optional<LocatedFrame> locate_from_last(const Frame& frame);
  std::optional<LocatedFrame> locate_near_keyframe(const Frame& frame, KeyframeId keyframe);
  /// Among the keyframes where it was last, or while mapping the newest ones of that sub-map.
  std::optional<LocatedFrame> recover(const Frame& frame);
  /// Anywhere in the map.
  std::optional<LocatedFrame> relocalize(const Frame& frame, StageTimes& times);
  LocatedFrame locate_in_local_map(const Frame& frame, const LocatedFrame& first);
  void refresh_local_map(const Frame& frame);
  void count_sightings(const ProjectionMatches& matches);
  TrackOutcome accept(const Frame& frame, const LocatedFrame& located);
  TrackOutcome lose(const Frame& frame, const PlaceDiagnosis& diagnosis, StageTimes& times);
  std::vector<KeyframeId> recovery_keyframes() const;
  KeyframeSituation assess(const Frame& frame, const LocatedFrame& located) const;
  NewKeyframe make_keyframe(const Frame& frame, const RelativePose& pose);
  std::vector<Sighting> take_sightings();

  const std::shared_ptr<const Rig> rig_;
  const bool has_range_;
  const TrackingSettings settings_;
  const double pixel_rad_;  ///< Angle of a pixel at the image centre.
  Initializer initializer_;
  ProjectionMatcher matcher_;
  AppearanceMatcher appearance_;
  FrameLocator locator_;
  Relocalizer relocalizer_;

  TrackingPurpose purpose_ = TrackingPurpose::kMapping;
  Mode mode_ = Mode::kInitializing;
  int num_lost_ = 0;  ///< Frames since the loss.
  std::shared_ptr<const Map> map_;
  std::shared_ptr<const PlaceIndex> places_;
  LocalMap local_;
  std::shared_ptr<const Map> local_map_source_;
  int local_map_age_ = 0;
  MotionModel motion_;
  RelativePose last_pose_;
  std::shared_ptr<const Features> last_features_;
  std::vector<LandmarkId> last_landmarks_;  ///< Per feature of the last frame.
  std::vector<LandmarkId> landmarks_;       ///< Per feature of this frame.
  std::vector<Sighting> sightings_;
  FrameId last_keyframe_frame_;
  std::uint32_t num_sent_ = 0;      ///< Keyframes sent to the mapper.
  std::uint32_t num_submaps_ = 0;   ///< Sub-maps sent to the mapper.
  std::uint32_t submap_start_ = 0;  ///< First keyframe of the sub-map, if that is a new one.
  LandmarkSet last_set_;
  std::vector<std::uint8_t> is_taken_;
};

}  // namespace waymark
