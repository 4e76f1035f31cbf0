// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/evaluate/time_offset.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "waymark/evaluate/association.h"

namespace waymark {
namespace {

using Column = Eigen::Ref<const Eigen::ArrayXd>;

/// Speeds in m/s and rad/s, at even steps.
using Speeds = Eigen::Array<double, Eigen::Dynamic, 2>;

constexpr double kSecondsPerNs = 1e-9;
/// Speeds over fewer steps agree by chance.
constexpr Eigen::Index kMinSteps = 20;
/// The search takes time with the square of it.
constexpr std::int64_t kMaxSteps = 4000;
/// A speed that varies by less, as a part of its mean, says nothing of time.
constexpr double kMinVariation = 0.05;
constexpr double kMinAgreement = 0.8;
constexpr std::int64_t kPrecisionNs = 100'000;

/// The pose at a time, between its neighbours; the first or last beyond the ends.
Rigid3 pose_at(std::span<const StampedPose> poses, std::int64_t time_ns) {
  const auto after = std::ranges::lower_bound(poses, time_ns, {}, &StampedPose::timestamp_ns);
  if (after == poses.begin()) return poses.front().world_from_camera;
  if (after == poses.end()) return poses.back().world_from_camera;
  const StampedPose& a = *std::prev(after);
  const StampedPose& b = *after;
  const double part = static_cast<double>(time_ns - a.timestamp_ns) /
                      static_cast<double>(b.timestamp_ns - a.timestamp_ns);
  const Rigid3& from = a.world_from_camera;
  const Rigid3& to = b.world_from_camera;
  return {from.rotation.slerp(part, to.rotation),
          from.translation + part * (to.translation - from.translation)};
}

Speeds speeds_of(std::span<const StampedPose> poses,
                 std::int64_t begin_ns,
                 std::int64_t step_ns,
                 Eigen::Index num_steps) {
  Speeds speeds(num_steps, 2);
  const double step_s = kSecondsPerNs * static_cast<double>(step_ns);
  Rigid3 last = pose_at(poses, begin_ns);
  for (Eigen::Index i = 0; i < num_steps; ++i) {
    const Rigid3 next = pose_at(poses, begin_ns + (i + 1) * step_ns);
    speeds(i, 0) = (next.translation - last.translation).norm() / step_s;
    speeds(i, 1) = last.rotation.angularDistance(next.rotation) / step_s;
    last = next;
  }
  return speeds;
}

/// Coefficient of correlation; nothing where one hardly varies.
std::optional<double> correlation(Column a, Column b) {
  const Eigen::ArrayXd from_a = a - a.mean(), from_b = b - b.mean();
  const double spread_a = from_a.matrix().norm(), spread_b = from_b.matrix().norm();
  const double root = std::sqrt(static_cast<double>(a.size()));
  if (spread_a <= kMinVariation * root * a.mean() || spread_b <= kMinVariation * root * b.mean()) {
    return std::nullopt;
  }
  return (from_a * from_b).sum() / (spread_a * spread_b);
}

/// Of what varies of two: the mean of the correlations; -1 where nothing does.
double agreement(const Eigen::Ref<const Speeds>& a, const Eigen::Ref<const Speeds>& b) {
  double sum = 0.0, count = 0.0;
  for (Eigen::Index channel = 0; channel < 2; ++channel) {
    const std::optional<double> r = correlation(a.col(channel), b.col(channel));
    if (!r) continue;
    sum += *r;
    count += 1.0;
  }
  return count > 0.0 ? sum / count : -1.0;
}

struct ClockShift {
  Eigen::Index steps = 0;  ///< Of the truth, at which the estimate begins.
  double agreement = -1.0;
};

/// Over half of the shorter one, or more.
ClockShift best_shift(const Speeds& estimate, const Speeds& truth) {
  const Eigen::Index n = estimate.rows(), m = truth.rows();
  const Eigen::Index least = std::max(kMinSteps, std::min(n, m) / 2);
  ClockShift best;
  for (Eigen::Index shift = least - n; shift <= m - least; ++shift) {
    const Eigen::Index begin = std::max<Eigen::Index>(0, -shift);
    const Eigen::Index length = std::min(n, m - shift) - begin;
    const double found =
        agreement(estimate.middleRows(begin, length), truth.middleRows(begin + shift, length));
    if (found > best.agreement) best = {shift, found};
  }
  return best;
}

std::int64_t duration_ns(std::span<const StampedPose> poses) {
  return poses.back().timestamp_ns - poses.front().timestamp_ns;
}

}  // namespace

std::int64_t moved_time(std::int64_t timestamp_ns, std::int64_t offset_ns) {
  std::int64_t moved = 0;
  if (!__builtin_add_overflow(timestamp_ns, offset_ns, &moved)) return moved;
  return offset_ns > 0 ? INT64_MAX : INT64_MIN;
}

std::optional<std::int64_t> find_time_offset(std::span<const StampedPose> estimate,
                                             std::span<const StampedPose> groundtruth) {
  const auto is_usable = [](std::span<const StampedPose> poses) {
    return poses.size() > 2 && poses.front().timestamp_ns >= 0;
  };
  if (!is_usable(estimate) || !is_usable(groundtruth)) return std::nullopt;
  const std::int64_t step_ns =
      std::max({median_interval_ns(estimate),
                median_interval_ns(groundtruth),
                std::max(duration_ns(estimate), duration_ns(groundtruth)) / kMaxSteps,
                std::int64_t{1}});
  const Eigen::Index n = duration_ns(estimate) / step_ns;
  const Eigen::Index m = duration_ns(groundtruth) / step_ns;
  if (std::min(n, m) < kMinSteps) return std::nullopt;
  const std::int64_t begin_ns = estimate.front().timestamp_ns;
  const std::int64_t true_begin_ns = groundtruth.front().timestamp_ns;
  const Speeds speeds = speeds_of(estimate, begin_ns, step_ns, n);
  const ClockShift shift = best_shift(speeds, speeds_of(groundtruth, true_begin_ns, step_ns, m));
  if (shift.agreement < kMinAgreement) return std::nullopt;

  // Finer than a step, over what both have in common.
  const Eigen::Index first = std::max<Eigen::Index>(0, 1 - shift.steps);
  const Eigen::Index length = std::min(n, m - shift.steps - 1) - first;
  const auto agreement_at = [&](std::int64_t offset_ns) {
    const std::int64_t from_ns = begin_ns + offset_ns + first * step_ns;
    return agreement(speeds.middleRows(first, length),
                     speeds_of(groundtruth, from_ns, step_ns, length));
  };
  std::int64_t offset_ns = true_begin_ns - begin_ns + shift.steps * step_ns;
  double best = agreement_at(offset_ns);
  for (std::int64_t change_ns = step_ns / 2; change_ns > kPrecisionNs; change_ns /= 2) {
    for (const std::int64_t tried_ns : {offset_ns - change_ns, offset_ns + change_ns}) {
      const double found = agreement_at(tried_ns);
      if (found <= best) continue;
      best = found;
      offset_ns = tried_ns;
    }
  }
  return offset_ns;
}

}  // namespace waymark
