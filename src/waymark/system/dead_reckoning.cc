// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/dead_reckoning.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "waymark/imu/inertial_residual.h"

namespace waymark {
namespace {

/// A state is told by as many frames beside it, and by fewer of those around as long.
constexpr std::size_t kBeside = 15;
constexpr std::size_t kAround = 25;
constexpr std::int64_t kAroundNs = 20'000'000'000;
/// What axes of a gyroscope that are not quite square and not of quite the same scale, and poses
/// that err alike, leave in rad.
constexpr double kSystematicTurn = 1e-3;

/// Of poses in the order of how near they are, all of those beside and some of those around.
std::vector<VisionPose> thin_out(std::span<const VisionPose> poses) {
  const std::size_t num_beside = std::min(kBeside, poses.size());
  std::vector<VisionPose> chosen(poses.begin(),
                                 poses.begin() + static_cast<std::ptrdiff_t>(num_beside));
  const std::size_t step = 1 + (poses.size() - num_beside) / kAround;
  for (std::size_t i = num_beside + step - 1; i < poses.size(); i += step) {
    chosen.push_back(poses[i]);
  }
  return chosen;
}

}  // namespace

DeadReckoning::DeadReckoning(const InertialKnowledge& known,
                             std::span<const TrajectoryFrame> frames)
    : begin_ns_(frames.back().timestamp_ns) {
  std::vector<VisionPose> poses;
  for (auto frame = frames.rbegin(); frame != frames.rend(); ++frame) {
    if (begin_ns_ - frame->timestamp_ns > kAroundNs) break;
    poses.push_back({frame->timestamp_ns, frame->world_from_rig.inverse()});
  }
  poses = thin_out(poses);
  std::ranges::reverse(poses);
  const auto told = start_again(known, poses);
  if (!told) return;
  time_shift_s_ = told->time_shift_s;
  setup_ = told->setup;
  first_ = {told->states.back(), told->covariance()};
}

std::optional<ReckonedPose> DeadReckoning::to(const InertialKnowledge& known,
                                              std::int64_t timestamp_ns) const {
  if (!first_ || timestamp_ns - begin_ns_ > kMaxBridgedNs) return std::nullopt;
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * time_shift_s_));
  auto now = predict(
      *first_, known.samples, begin_ns_ + shift_ns, timestamp_ns + shift_ns, known.noise, setup_);
  if (!now) return std::nullopt;
  now->covariance.diagonal().segment<3>(kStateAt + 3).array() += kSystematicTurn * kSystematicTurn;
  if (!is_sure(known, now->covariance)) return std::nullopt;
  return ReckonedPose{now->state.rig_from_world * first_->state.rig_from_world.inverse(),
                      now->covariance.block<6, 6>(kStateAt, kStateAt)};
}

}  // namespace waymark
