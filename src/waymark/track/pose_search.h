// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "waymark/base/stage_times.h"
#include "waymark/match/rotation_alignment.h"
#include "waymark/place/map_snapshot.h"
#include "waymark/track/frame.h"
#include "waymark/track/frame_locator.h"
#include "waymark/track/last_frame.h"
#include "waymark/track/local_map.h"
#include "waymark/track/patch_locator.h"
#include "waymark/track/pose_check.h"
#include "waymark/track/relocalizer.h"
#include "waymark/track/settings.h"

namespace waymark {

/// Finds the pose of a frame in the map. There is a list of ways to it (kSteps in the source):
/// by motion from the last frame, where an IMU has it, near the last pose after a loss, by
/// keyframes nearby, by the patches of the images, and anywhere in the map. The first pose that the
/// local map around it confirms is the one of the frame. Keeps its buffers.
class PoseSearch {
 public:
  /// What is known beforehand.
  struct Context {
    const MapSnapshot& visible;  ///< The map that is searched.
    LastFrame& last;             ///< The newest frame that had a pose, if any had.
    bool is_lost;                ///< Whether the frame before had none.
    int num_lost;                ///< Frames without one since.
    bool is_extending;           ///< Whether the map goes on growing.
  };

  PoseSearch(const TrackingSettings& settings, std::uint64_t seed)
      : settings_(settings), relocalizer_(settings, seed), check_(settings.options.pose_check) {}

  /// The pose of a frame. Its features become those that the frame would have without the motion
  /// that its pose shows (of a rolling shutter), or get points that show landmarks by their
  /// patches.
  std::optional<LocatedFrame> locate(Frame& frame, const Context& context, StageTimes& times);

  /// Which of the ways led to the last pose; empty where none did.
  std::string_view found_by() const { return found_by_; }
  /// Why the last frame was not found.
  FrameStatus failure() const { return check_.refusal().value_or(relocalizer_.diagnosis()); }

  /// The surroundings of the last pose.
  const LocalMap& local_map() const { return local_map_.around(); }
  /// Those around the last pose, and while the map grows the newest ones of its sub-map.
  std::vector<KeyframeId> keyframes_nearby(const Context& context) const;
  /// The map is another one from now on, which may lack what is newest.
  void continue_in(const Map& map);

 private:
  using Found = std::optional<LocatedFrame>;
  struct Step;
  static const std::array<Step, 7> kSteps;

  const PoseSearchOptions& options() const { return settings_.options.pose_search; }

  Found at_rest(Frame& frame, const Context& context);
  Found by_motion(Frame& frame, const Context& context);
  Found by_dead_reckoning(Frame& frame, const Context& context);
  Found near_last_pose(Frame& frame, const Context& context);
  Found by_keyframes_nearby(Frame& frame, const Context& context);
  Found by_patches(Frame& frame, const Context& context);
  Found anywhere(Frame& frame, const Context& context);

  /// By landmarks of the last frame, near where this pose puts them.
  Found locate_near(const Frame& frame,
                    const Context& context,
                    const Rigid3& rig_from_world,
                    double radius_px);
  /// The motion before goes on, and the turn since then is told by the images.
  Found locate_by_image(const Frame& frame, const Context& context);
  /// The pose as the motion predicts it, but turned as the image tells. Nothing where that does not
  /// resemble the last one.
  std::optional<Rigid3> predict_by_image(const Frame& frame, const Context& context);
  Found locate_near_keyframe(const Frame& frame, const Map& map, KeyframeId keyframe);
  Found confirm_in_local_map(const Frame& frame, const Context& context, LocatedFrame first);

  const TrackingSettings settings_;
  RotationAligner rotation_aligner_;
  PatchLocator patch_locator_;
  FrameLocator locator_;
  Relocalizer relocalizer_;
  PoseCheck check_;
  RecentLocalMap local_map_;
  std::string_view found_by_;
  std::optional<Rigid3> resting_;  ///< Where the rig came to rest; none where it moves.
  int num_rested_ = 0;             ///< Frames at rest that show it.
  int num_unseen_ = 0;  ///< Frames at rest that do not show what is around, the last ones in turn.
};

}  // namespace waymark
