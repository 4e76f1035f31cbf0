// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/rotation_vote.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

Eigen::Vector3d random_direction(Rng& rng) {
  return Eigen::Vector3d(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0))
      .normalized();
}

Eigen::Matrix3d random_turn(Rng& rng, double max_rad) {
  return Eigen::AngleAxisd(rng.uniform(0.0, max_rad), random_direction(rng)).toRotationMatrix();
}

/// A feature that looks along the third axis, its patch oriented along the first; the image around
/// it lies in any way and is as stretched as near the pole of a 360 degree image.
void add(const Eigen::Matrix3d& frame, Rng& rng, Features& features) {
  const double turn = rng.uniform(-kPi, kPi);
  Eigen::Matrix<double, 2, 3> pixel_from_bearing;
  pixel_from_bearing << std::cos(turn) * frame.col(0).transpose() -
                            std::sin(turn) * frame.col(1).transpose(),
      std::sin(turn) * frame.col(0).transpose() + std::cos(turn) * frame.col(1).transpose();
  pixel_from_bearing.row(0) *= 300.0;
  pixel_from_bearing.row(1) *= 100.0;
  const Eigen::Vector2d in_image = pixel_from_bearing * frame.col(0);
  Keypoint keypoint;
  keypoint.angle_rad = static_cast<float>(std::atan2(in_image.y(), in_image.x()));
  features.keypoints.push_back(keypoint);
  features.bearings.push_back(frame.col(2).cast<float>());
  features.level_pixel_from_bearing.push_back(pixel_from_bearing.cast<float>());
  ++features.num_primary;
}

TEST(RotationVote, FindsTheMatchesThatTurnedAlikeAmongMoreByChance) {
  constexpr std::uint32_t kNumTrue = 20;
  constexpr std::uint32_t kNumFalse = 100;
  Rng rng(4, 0);
  RotationVote vote;
  for (int round = 0; round < 20; ++round) {
    const Eigen::Matrix3d b_from_a = random_turn(rng, kPi);
    Features a, b;
    std::vector<FeatureMatch> matches;
    for (std::uint32_t i = 0; i < kNumTrue + kNumFalse; ++i) {
      const Eigen::Matrix3d frame = random_turn(rng, kPi);
      add(frame, rng, a);
      const bool is_true = i < kNumTrue;
      add(is_true ? Eigen::Matrix3d(random_turn(rng, 0.2) * b_from_a * frame)
                  : random_turn(rng, kPi),
          rng,
          b);
      matches.push_back({i, i, 0});
    }
    const auto agreeing = vote.agreeing(a, b, matches);
    std::uint32_t num_true = 0;
    for (const FeatureMatch& match : agreeing) num_true += match.a < kNumTrue;
    EXPECT_GE(num_true, kNumTrue - 1) << "round " << round;
    EXPECT_LE(agreeing.size() - num_true, 8u) << "round " << round;
  }
}

TEST(RotationVote, HasNothingToSayOfNoMatches) {
  RotationVote vote;
  EXPECT_TRUE(vote.agreeing(Features(), Features(), {}).empty());
}

}  // namespace
}  // namespace waymark
