// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/evaluate/time_offset.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "waymark/base/rng.h"
#include "waymark/evaluate/evaluation.h"

namespace waymark {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

/// A walk with the speeds of nothing else, from begin_s to end_s of its own time.
std::vector<StampedPose> walk(double begin_s, double end_s, double rate_hz, double noise_m = 0.0) {
  Rng rng(5, 0);
  std::vector<StampedPose> poses;
  for (double t = begin_s; t < end_s; t += 1.0 / rate_hz) {
    const Eigen::Vector3d position(t + 0.4 * std::sin(1.3 * t),
                                   0.5 * std::sin(0.7 * t) + 0.3 * std::cos(2.1 * t),
                                   0.1 * std::sin(3.0 * t));
    const double angle = 0.8 * std::sin(0.9 * t) + 0.3 * std::sin(2.3 * t + 1.0);
    const Eigen::Vector3d noise(rng.normal(), rng.normal(), rng.normal());
    poses.push_back({std::llround(1e9 * t),
                     {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())),
                      position + noise_m * noise}});
  }
  return poses;
}

/// In a frame and scale of its own, by another clock.
std::vector<StampedPose> seen_by_another(std::vector<StampedPose> poses, std::int64_t later_ns) {
  for (StampedPose& pose : poses) {
    pose.timestamp_ns += later_ns;
    pose.world_from_camera.translation *= 0.2;
    pose.world_from_camera =
        Rigid3(Eigen::Quaterniond(0.5, 0.1, -0.7, 0.3).normalized(), {5, -3, 8}) *
        pose.world_from_camera;
  }
  return poses;
}

TEST(FindTimeOffset, FindsWhereTheSpeedsAgree) {
  const std::vector<StampedPose> truth = walk(0.0, 30.0, 100.0);
  for (const double offset_s : {-1.0, 0.0, 0.013, 2.5, 1.4e9}) {
    SCOPED_TRACE(offset_s);
    const std::int64_t offset_ns = std::llround(1e9 * offset_s);
    const auto estimate = seen_by_another(walk(4.0, 24.0, 20.0, 0.002), 0);
    std::vector<StampedPose> moved = truth;
    for (StampedPose& pose : moved) pose.timestamp_ns += offset_ns + kSecondNs;
    const auto found = find_time_offset(estimate, moved);
    ASSERT_TRUE(found);
    EXPECT_NEAR(static_cast<double>(*found - offset_ns - kSecondNs), 0.0, 5e6);
  }
}

TEST(FindTimeOffset, FindsNothingWhereSpeedsDoNotTell) {
  std::vector<StampedPose> even(400);
  for (std::size_t i = 0; i < even.size(); ++i) {
    even[i].timestamp_ns = static_cast<std::int64_t>(i) * kSecondNs / 20;
    even[i].world_from_camera.translation = {0.1 * static_cast<double>(i), 0, 0};
  }
  const std::vector<StampedPose> truth = walk(0.0, 30.0, 20.0);
  EXPECT_FALSE(find_time_offset(even, even));
  EXPECT_FALSE(find_time_offset(even, truth));
  EXPECT_FALSE(find_time_offset(std::span(truth).first(10), truth));
  EXPECT_FALSE(find_time_offset({}, truth));
  EXPECT_FALSE(find_time_offset(walk(100.0, 130.0, 20.0), truth));  // Another way.
}

TEST(FindTimeOffset, SurvivesTimesThatAreFarApart) {
  std::vector<StampedPose> wild = walk(0.0, 30.0, 20.0);
  wild.back().timestamp_ns = INT64_MAX;
  EXPECT_FALSE(find_time_offset(wild, walk(0.0, 30.0, 20.0)));
  EXPECT_EQ(moved_time(INT64_MAX - 1, 5), INT64_MAX);
  EXPECT_EQ(moved_time(INT64_MIN + 1, -5), INT64_MIN);
  EXPECT_EQ(moved_time(7, -5), 2);
}

TEST(Evaluate, AddsTheOffsetToTheEstimate) {
  const std::vector<StampedPose> truth = walk(2.0, 12.0, 20.0);
  const auto estimate = seen_by_another(truth, -kSecondNs);
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kSim3;
  EXPECT_GT(evaluate(estimate, truth, options).ate_m.rmse, 0.05);
  options.time_offset_ns = kSecondNs;
  const Evaluation evaluation = evaluate(estimate, truth, options);
  EXPECT_LT(evaluation.ate_m.rmse, 1e-9);
  EXPECT_EQ(evaluation.num_pairs, truth.size());
  EXPECT_DOUBLE_EQ(evaluation.coverage, 1.0);
  EXPECT_EQ(evaluation.errors.front().timestamp_ns, truth.front().timestamp_ns);
}

}  // namespace
}  // namespace waymark
