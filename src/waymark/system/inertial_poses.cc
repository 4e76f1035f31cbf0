// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/inertial_poses.h"

#include <algorithm>

#include "waymark/base/median.h"
#include "waymark/system/trajectory.h"
#include "waymark/track/last_frame.h"

namespace waymark {
namespace {

/// Of a longer way every second, third, ... frame is looked at.
constexpr std::size_t kMaxPoses = 200;
/// Neighbours among them are so near in time; in bursts of so many where the way is too long.
constexpr std::int64_t kMaxStepNs = 500'000'000;
constexpr std::size_t kBurst = 20;

/// Poses evenly over the way; where these would be too far apart, in bursts.
std::vector<VisionPose> spread_out(std::span<const VisionPose> poses) {
  const std::size_t step = 1 + poses.size() / kMaxPoses;
  const auto step_ns = [&](std::size_t i) {
    return poses[std::min(i, poses.size() - 1)].timestamp_ns - poses[0].timestamp_ns;
  };
  std::vector<VisionPose> chosen;
  if (step_ns(step) <= kMaxStepNs) {
    for (std::size_t i = 0; i < poses.size(); i += step) chosen.push_back(poses[i]);
    return chosen;
  }
  std::size_t near_step = 1;
  while (step_ns(near_step + 1) <= kMaxStepNs) ++near_step;
  for (std::size_t burst = 0; burst < poses.size(); burst += step * kBurst) {
    const std::size_t end = std::min(poses.size(), burst + near_step * kBurst);
    for (std::size_t i = burst; i < end; i += near_step) chosen.push_back(poses[i]);
  }
  return chosen;
}

}  // namespace

std::vector<VisionPose> choose_poses(std::span<const TrajectoryFrame> frames, SubmapId submap) {
  std::vector<VisionPose> poses;
  for (const TrajectoryFrame& frame : frames) {
    if (frame.submap != submap || frame.state != FrameState::kTracked) continue;
    poses.push_back({frame.timestamp_ns, frame.world_from_rig.inverse()});
  }
  return spread_out(poses);
}

double distance_of_things(const Map& map, SubmapId submap) {
  std::vector<float> inverse;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap != submap) return;
    const float of_one = median_inverse_range(map, keyframe.rig_from_world, keyframe.landmarks);
    if (of_one > 0.0f) inverse.push_back(of_one);
  });
  return inverse.empty() ? 1.0 : 1.0 / static_cast<double>(median(inverse));
}

}  // namespace waymark
