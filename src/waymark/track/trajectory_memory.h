// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/track/frame.h"
#include "waymark/track/frame_locator.h"
#include "waymark/track/pose_refiner.h"
#include "waymark/track/tracking_result.h"

namespace waymark {

/// What is remembered of every frame: its state, its pose relative to a keyframe, and, until the
/// map around it has settled, what it saw. Of that the newest kMaxUnsettled frames at most, of
/// those after one keyframe kMaxSinceKeyframe, and of frames without a pose the newest kMaxUnposed,
/// so that memory per frame stays small in sessions of any length, and at rest.
class TrajectoryMemory {
 public:
  static constexpr std::size_t kMaxUnsettled = 600;
  static constexpr std::size_t kMaxUnposed = 300;
  static constexpr std::uint32_t kMaxSinceKeyframe = 300;

  /// There is one for every frame for as long as a session lasts: packed, 80 bytes for 96.
  class Entry {
   public:
    Entry(std::int64_t time_ns, FrameState state_in, const RelativePose& pose);

    /// Where state is kTracked or kFilled.
    RelativePose pose() const;
    void set_pose(const RelativePose& pose);

    /// Whether it has a pose by what it shows, not by an IMU alone.
    bool is_seen() const {
      return !is_reckoned && (state == FrameState::kTracked || state == FrameState::kFilled);
    }

    std::int64_t timestamp_ns;
    FrameState state;
    bool is_reckoned = false;  ///< Whether it is filled by what an IMU told.

   private:
    KeyframeId reference_;
    double reference_scale_ = 1.0;
    std::array<double, 4> rotation_{};  ///< Coefficients in the order of Eigen.
    std::array<double, 3> translation_{};
  };

  /// first: the id of the first frame; those of the others follow.
  explicit TrajectoryMemory(FrameId first = FrameId{0}) : first_(first), newest_sent_(first) {}

  FrameId first() const { return first_; }
  /// The id of the frame after those added so far.
  FrameId next() const {
    return FrameId{first_.value + static_cast<std::uint32_t>(entries_.size())};
  }

  /// Adds the next frame; map is the one it was tracked in.
  void add(const Frame& frame, const TrackingResult& result, const Map& map);
  /// Finds the poses of all unsettled frames again in the final map, and from there those of the
  /// frames before and after them that had none. Once more where the map was moved since. rig: as
  /// calibrated by now.
  void settle(const Rig& rig, const Map& map);

  /// How the rig moved in a frame, without what it saw, by the poses of the frames before and after
  /// it; nothing where neither has one.
  std::optional<RigMotion> motion_in(FrameId frame, const Map& map) const;

  /// The frame of an index (of entries()) has this pose by what an IMU told, too, or alone if it is
  /// not seen. beside: the index of one that is seen, whose keyframe it refers to.
  void set_inertial_pose(std::int64_t index,
                         std::int64_t beside,
                         const Rigid3& rig_from_world,
                         const Map& map);

  /// Pose of an entry in a sub-map; nothing where there is none.
  std::optional<Rigid3> rig_from_world(std::int64_t index, SubmapId submap, const Map& map) const;

  /// In the order of the frames.
  const std::deque<Entry>& entries() const { return entries_; }
  /// Frames that were found again after a loss.
  int num_relocalizations() const { return num_relocalizations_; }

 private:
  /// What a frame without a keyframe's place in the map saw.
  struct Unsettled {
    FrameId frame;
    std::vector<SeenLandmark> seen;            ///< Of a tracked frame.
    std::shared_ptr<const Features> features;  ///< Of a frame filled in later.
    float readout_s = 0.0f;                    ///< That pixels are corrected for.
    float inverse_depth_offset = 0.0f;         ///< That depths are freed of, in 1/m.
    std::optional<Eigen::Vector3f> turn_rad_s = std::nullopt;  ///< By a gyroscope.
  };

  /// A frame that had no pose when it was tracked.
  struct Unposed {
    FrameId frame;
    std::shared_ptr<const Features> features;
  };

  Entry& entry_of(FrameId frame) { return entries_.at(frame.value - first_.value); }
  void settle(const Unsettled& unsettled, const Rig& rig, const Map& map);
  /// Looks for a frame near its neighbour, one step (1 or -1 frames) away.
  void fill(const Unposed& unposed, int step, const Rig& rig, const Map& map);

  const FrameId first_;
  FrameId newest_sent_;  ///< To the map.
  int num_relocalizations_ = 0;
  std::deque<Entry> entries_;  ///< Grows without copies of its own.
  std::deque<Unsettled> unsettled_;
  std::deque<Unposed> unposed_;
  PoseRefiner refiner_;
  FrameLocator locator_;
};

}  // namespace waymark
