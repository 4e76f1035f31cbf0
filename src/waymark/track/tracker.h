// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "waymark/place/map_snapshot.h"
#include "waymark/track/frame.h"
#include "waymark/track/initializer.h"
#include "waymark/track/keyframe_decision.h"
#include "waymark/track/landmark_visibility.h"
#include "waymark/track/last_frame.h"
#include "waymark/track/pose_search.h"
#include "waymark/track/predicted_ids.h"
#include "waymark/track/scale_transfer.h"
#include "waymark/track/tracking_result.h"

namespace waymark {

/// Whether frames are only located in a map or also extend it.
enum class TrackingPurpose { kMapping, kLocalizing };

/// Follows the camera through the map, frame by frame (Klein and Murray 2007; Mur-Artal et al.
/// 2015): locate it in the map (PoseSearch), decide on a keyframe, hand that over. What is found
/// nowhere helps to start a new sub-map (Initializer).
/// Reads frozen maps, writes messages. The mapper must take the messages in order and give
/// keyframes and sub-maps consecutive ids; a new sub-map must show in the next frame.
class Tracker {
 public:
  Tracker(bool has_range, const TrackingSettings& settings, std::uint64_t seed);

  /// Begins lost in a map made before, with or without the right to extend it; before the first
  /// frame. Ids go on from those of the map.
  void begin_in(const Map& map, TrackingPurpose purpose);

  /// Whether the map goes on growing, or stays as it is while the camera is followed in it.
  void set_purpose(TrackingPurpose purpose) { purpose_ = purpose; }

  /// Goes on between two frames with this purpose in a map that lacks what is newest of the one so
  /// far, or nothing. What is not in it is forgotten.
  void continue_in(const Map& map, TrackingPurpose purpose);

  /// Time of the newest frame that has a pose, if any has.
  std::optional<std::int64_t> last_pose_ns() const {
    return last_.has_pose() ? std::optional(last_.timestamp_ns()) : std::nullopt;
  }

  /// How the rig should move in the frame to come; 0 where that is not known.
  RigMotion predict_motion() const;

  /// Parts of a map in mono that began after a loss in the units of the part before.
  std::vector<TransferredScale> kept_scales(const Map& map) const {
    return scale_keeper_.kept_in(map);
  }

  /// Tracks a frame; visible: the newest map that it may see, empty before the first sub-map. Fills
  /// in what becomes of it (stages are added to). Gives what the mapper is to take in, if the frame
  /// becomes a keyframe.
  std::optional<MapperMessage> track(const Frame& frame,
                                     const MapSnapshot& visible,
                                     TrackingResult& result);

  /// Which way of PoseSearch led to the last pose; empty where none did.
  std::string_view found_by() const { return search_.found_by(); }

 private:
  enum class Mode { kInitializing, kTracking, kLost };

  PoseSearch::Context context();
  /// Of an accepted pose.
  void count_visibility(const Features& features, const LocatedFrame& located);
  bool is_keyframe(const Frame& frame, const LocatedFrame& located) const;
  std::optional<MapperMessage> accept(const Frame& frame,
                                      LocatedFrame located,
                                      TrackingResult& result);
  /// Starts a new sub-map, or keeps looking.
  std::optional<MapperMessage> lose(const Frame& frame,
                                    const FrameStatus& why,
                                    TrackingResult& result);
  /// The pose that an IMU tells of a frame that is not found.
  void go_on_reckoned(const ReckonedPose& reckoned, TrackingResult& result);
  std::optional<MapperMessage> initialize(const Frame& frame, TrackingResult& result);
  /// The first pose of a new sub-map, if this frame completes one.
  std::optional<MapperMessage> start_submap(const Frame& frame, TrackingResult& result);

  const bool has_range_;
  const TrackingSettings settings_;
  Initializer initializer_;
  PoseSearch search_;
  ScaleTransfer scale_keeper_;
  TrackingPurpose purpose_ = TrackingPurpose::kMapping;
  Mode mode_ = Mode::kInitializing;
  int num_lost_ = 0;     ///< Frames since the loss.
  int num_unfound_ = 0;  ///< Of them, those that show something.
  MapSnapshot visible_;
  LastFrame last_;
  PredictedIds ids_;
  std::optional<KeyframeView> newest_view_;  ///< Of the frame that became a keyframe last.
  VisibilityCounter visibility_;
};

}  // namespace waymark
