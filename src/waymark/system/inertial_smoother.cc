// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/inertial_smoother.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace waymark {
namespace {

/// Frames that are solved for at a time, and of them those at either end that only lead there.
constexpr std::size_t kWindow = 600;
constexpr std::size_t kOverlap = 100;
/// What is reckoned is not sure where it may be off by this part of how far away things are, or
/// by this angle in rad: then what is seen again is not found from there.
constexpr double kSurePart = 0.15;
constexpr double kSureAngle = 0.1;

/// Poses of neighbouring frames err alike, so that each by itself tells less than its own standard
/// deviation does: by this factor.
constexpr double kLooser = 3.0;

/// A frame of the trajectory that is smoothed.
struct SmoothedFrame {
  std::int64_t index = 0;  ///< Of an entry of the memory.
  VisionPose pose;
};

/// Goes over the trajectory and gives every stretch of it in a part of the map that is not broken.
class Stretches {
 public:
  Stretches(SubmapId submap, const Map& map, const TrajectoryMemory& memory)
      : submap_(submap), map_(map), memory_(memory) {}

  /// Begins with a frame that is seen; empty after the last one.
  std::vector<SmoothedFrame> next() {
    std::vector<SmoothedFrame> stretch;
    for (; at_ < std::ssize(memory_.entries()); ++at_) {
      const TrajectoryMemory::Entry& entry = memory_.entries()[static_cast<std::size_t>(at_)];
      if (!entry.is_seen()) {
        if (!stretch.empty()) stretch.push_back({at_, {entry.timestamp_ns, {}, false}});
        continue;
      }
      const auto seen = memory_.rig_from_world(at_, submap_, map_);
      if (!stretch.empty() && (!seen || !close_gap(stretch, entry.timestamp_ns, *seen))) break;
      if (seen) stretch.push_back({at_, {entry.timestamp_ns, *seen}});
    }
    if (!stretch.empty()) end_gap(stretch);
    return stretch;
  }

 private:
  static std::vector<SmoothedFrame>::iterator last_seen(std::vector<SmoothedFrame>& stretch) {
    auto last = std::prev(stretch.end());
    while (!last->pose.is_seen) --last;
    return last;
  }

  /// Frames after the last one that is seen begin there.
  static void end_gap(std::vector<SmoothedFrame>& stretch) {
    const VisionPose last = last_seen(stretch)->pose;
    while (stretch.back().pose.timestamp_ns - last.timestamp_ns > kMaxBridgedNs) stretch.pop_back();
    for (auto frame = stretch.rbegin(); !frame->pose.is_seen; ++frame) {
      frame->pose.rig_from_world = last.rig_from_world;
    }
  }

  /// Guesses where the frames at the end of a stretch that are not seen are from the next one that
  /// is. False where there are none for too long.
  static bool close_gap(std::vector<SmoothedFrame>& stretch,
                        std::int64_t timestamp_ns,
                        const Rigid3& rig_from_world) {
    const auto last = last_seen(stretch);
    const VisionPose before = last->pose;
    const std::int64_t gap_ns = timestamp_ns - before.timestamp_ns;
    if (gap_ns > kMaxBridgedNs) return false;
    const Vector6d motion = (rig_from_world * before.rig_from_world.inverse()).log();
    for (auto frame = last + 1; frame != stretch.end(); ++frame) {
      const double part = static_cast<double>(frame->pose.timestamp_ns - before.timestamp_ns) /
                          static_cast<double>(gap_ns);
      frame->pose.rig_from_world = Rigid3::exp(part * motion) * before.rig_from_world;
    }
    return true;
  }

  const SubmapId submap_;
  const Map& map_;
  const TrajectoryMemory& memory_;
  std::int64_t at_ = 0;
};

/// Of pose and velocity. Poses of vision err alike for long, which no number of them averages out.
Eigen::Matrix<double, 9, 9> covariance_of(const InertialKnowledge& known,
                                          const InertialStart& told,
                                          std::size_t i) {
  const double less_sure = told.less_sure() * told.less_sure();
  Eigen::Matrix<double, 9, 9> covariance =
      less_sure * told.covariances[i].block<9, 9>(kStateAt, kStateAt);
  const Eigen::Vector3d by_scale = kSystematicScale * told.states[i].velocity;
  covariance.diagonal().head<3>().array() += std::pow(known.options.pose_position_sigma, 2);
  covariance.diagonal().segment<3>(3).array() += std::pow(known.options.pose_rotation_sigma, 2);
  covariance.bottomRightCorner<3, 3>() += by_scale * by_scale.transpose();
  return covariance;
}

void smooth_window(const InertialKnowledge& known,
                   std::span<const SmoothedFrame> window,
                   std::size_t first_wanted,
                   std::size_t end_wanted,
                   const Map& map,
                   TrajectoryMemory& memory,
                   std::vector<NavigationState>& path) {
  std::vector<VisionPose> poses;
  for (const SmoothedFrame& frame : window) poses.push_back(frame.pose);
  const auto told = start_again(known, poses);
  if (!told) return;
  if (told->is_contradicted()) return;
  // What follows the last frame that is seen is only as good as it is at the end.
  while (!is_sure(known, told->covariance()) && end_wanted > 0 && !poses[end_wanted - 1].is_seen) {
    --end_wanted;
  }
  std::optional<std::int64_t> beside;
  for (std::size_t i = 0; i < end_wanted; ++i) {
    if (poses[i].is_seen) beside = window[i].index;
    if (i < first_wanted || !beside) continue;
    const InertialState& state = told->states[i];
    memory.set_inertial_pose(window[i].index, *beside, state.rig_from_world, map);
    path.push_back({poses[i].timestamp_ns,
                    state.rig_from_world.inverse(),
                    state.velocity,
                    covariance_of(known, *told, i),
                    state.biases});
  }
}

}  // namespace

std::optional<InertialStart> start_again(const InertialKnowledge& known,
                                         std::span<const VisionPose> poses) {
  const InertialStart& found = known.found;
  const ImuCalibration told{found.setup.imu_from_rig, found.time_shift_s, known.noise};
  InertialStartOptions options = known.options;
  if (known.has_same_scale) {
    options.log_scale = found.setup.log_scale;
    options.log_scale_sigma = found.sigma(kLogScaleAt);
  }
  options.told_lever_arm_sigma = largest_sigma(found.covariance(), kLeverArmAt);
  options.told_rotation_sigma = largest_sigma(found.covariance(), kRotationAt);
  options.told_time_shift_sigma_s = found.sigma(kTimeShiftAt);
  options.pose_position_sigma *= kLooser;
  options.pose_rotation_sigma *= kLooser;
  return start_inertial(known.samples, poses, told, known.noise, options);
}

bool is_sure(const InertialKnowledge& known, const Matrix25d& covariance) {
  return largest_sigma(covariance, kStateAt) < kSurePart * known.distance_of_things &&
         largest_sigma(covariance, kStateAt + 3) < kSureAngle;
}

std::vector<NavigationState> smooth_trajectory(const InertialKnowledge& known,
                                               SubmapId submap,
                                               const Map& map,
                                               TrajectoryMemory& memory) {
  std::vector<NavigationState> path;
  Stretches stretches(submap, map, memory);
  while (true) {
    const std::vector<SmoothedFrame> stretch = stretches.next();
    if (stretch.empty()) return path;
    for (std::size_t first = 0; first < stretch.size(); first += kWindow - 2 * kOverlap) {
      const std::size_t count = std::min(kWindow, stretch.size() - first);
      const bool is_last = first + count == stretch.size();
      smooth_window(known,
                    std::span(stretch).subspan(first, count),
                    first == 0 ? 0 : kOverlap,
                    is_last ? count : count - kOverlap,
                    map,
                    memory,
                    path);
      if (is_last) break;
    }
  }
}

}  // namespace waymark
