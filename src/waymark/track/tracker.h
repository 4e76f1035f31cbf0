// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/match/appearance.h"
#include "waymark/match/turn_alignment.h"
#include "waymark/track/frame.h"
#include "waymark/track/frame_locator.h"
#include "waymark/track/frame_verdict.h"
#include "waymark/track/initializer.h"
#include "waymark/track/keyframe_decision.h"
#include "waymark/track/last_frame.h"
#include "waymark/track/local_map.h"
#include "waymark/track/map_snapshot.h"
#include "waymark/track/patch_locator.h"
#include "waymark/track/pose_refiner.h"
#include "waymark/track/relocalizer.h"
#include "waymark/track/scale_keeper.h"
#include "waymark/track/sent_ids.h"
#include "waymark/track/sightings.h"
#include "waymark/track/stage_times.h"

namespace waymark {

/// Whether frames are only located in a map or also extend it.
enum class TrackingPurpose { kMapping, kLocalizing };

/// What tracking a frame gave.
struct TrackOutcome : FrameVerdict {
  FrameDetails details;                  ///< Its pose has the id that a keyframe will have.
  std::optional<MapperMessage> message;  ///< For the mapper; a frame with a message is a keyframe.
  std::vector<SeenLandmark> seen;        ///< What the pose rests on.
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

  /// From the next frame on its features are of the same cameras calibrated otherwise.
  void look_with(std::shared_ptr<const Rig> rig);

  /// Whether the map goes on growing, or stays as it is while the camera is followed in it.
  void set_purpose(TrackingPurpose purpose) { purpose_ = purpose; }

  /// Goes on between two frames with this purpose in a map that lacks what is newest of the one so
  /// far, or nothing. What is not in it is forgotten.
  void continue_in(const Map& map, TrackingPurpose purpose);

  /// How the rig should move in the frame to come; 0 where that is not known.
  RigMotion predict_motion() const;

  /// Parts of a map in mono that began after a loss in the units of the part before.
  std::vector<KeptScale> kept_scales(const Map& map) const { return scale_keeper_.kept_in(map); }

  /// visible: the newest map that this frame may see; empty before the first sub-map.
  TrackOutcome track(const Frame& frame, const MapSnapshot& visible, StageTimes& times);

 private:
  enum class Mode { kInitializing, kTracking, kLost };

  /// The frame as it would be with the motion that its pose shows; of a rolling shutter alone.
  Frame straightened(const Frame& frame, const LocatedFrame& located) const;
  std::optional<LocatedFrame> locate_from_last(const Frame& frame, StageTimes& times);
  /// By landmarks of the last frame, near where this pose puts them.
  std::optional<LocatedFrame> locate_near(const Frame& frame,
                                          const Rigid3& rig_from_world,
                                          double radius_px);
  /// From where the motion before leads, searched for as far as the tracker ever does.
  std::optional<LocatedFrame> locate_by_motion(const Frame& frame);
  /// The same, the turn since then being told by the images.
  std::optional<LocatedFrame> locate_by_image(const Frame& frame);
  /// From the images around the landmarks, where features do not tell. The frame gets features that
  /// show those whose surroundings are alike.
  std::optional<LocatedFrame> locate_by_patches(Frame& frame, StageTimes& times);
  /// Its pose as the motion predicts it, but turned as its image tells. Nothing where that does not
  /// resemble the last one.
  std::optional<Rigid3> predict_by_image(const Frame& frame);
  /// From the last frame that had a pose, else among the keyframes where it was last, or while
  /// mapping the newest ones of that sub-map.
  std::optional<LocatedFrame> recover(const Frame& frame, StageTimes& times);
  std::vector<KeyframeId> recovery_keyframes() const;
  std::optional<LocatedFrame> locate_near_keyframe(const Frame& frame, KeyframeId keyframe);
  /// Anywhere in the map.
  std::optional<LocatedFrame> relocalize(const Frame& frame, StageTimes& times);
  std::optional<LocatedFrame> locate_in_local_map(const Frame& frame,
                                                  std::optional<LocatedFrame> first,
                                                  StageTimes& times);
  void refresh_local_map(const Features& features, const LocatedFrame& located);
  /// Of an accepted pose, the local map having been searched with it.
  void count_sightings(const Features& features, const LocatedFrame& located);
  bool is_keyframe(const Frame& frame, const LocatedFrame& located) const;
  TrackOutcome accept(const Frame& frame, LocatedFrame located, StageTimes& times);
  /// Starts a new sub-map, or keeps looking.
  TrackOutcome lose(const Frame& frame, const FrameStatus& why, StageTimes& times);
  TrackOutcome initialize(const Frame& frame, StageTimes& times);
  /// The first pose of a new sub-map, if this frame completes one.
  std::optional<TrackOutcome> start_submap(const Frame& frame, StageTimes& times);

  std::shared_ptr<const Rig> rig_;
  const bool has_range_;
  const TrackingSettings settings_;
  const std::uint64_t seed_;
  Initializer initializer_;
  AppearanceMatcher appearance_;
  TurnAligner turn_aligner_;
  PatchLocator patch_locator_;
  FrameLocator locator_;
  Relocalizer relocalizer_;
  ScaleKeeper scale_keeper_;
  KeyframeAssessor keyframe_assessor_;
  std::array<double, 2> search_radii_px_;  ///< Around a prediction, and when that fails.

  TrackingPurpose purpose_ = TrackingPurpose::kMapping;
  Mode mode_ = Mode::kInitializing;
  int num_lost_ = 0;  ///< Frames since the loss.
  std::shared_ptr<const Map> map_;
  std::shared_ptr<const PlaceIndex> places_;
  LocalMap local_;
  std::shared_ptr<const Map> local_map_source_;
  int local_map_age_ = 0;
  LastFrame last_;
  FrameId last_keyframe_frame_;
  SentIds ids_;
  SightingCounter sightings_;
};

}  // namespace waymark
