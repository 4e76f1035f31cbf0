// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/rolling_shutter.h"

#include <gtest/gtest.h>

#include <vector>

#include "waymark/camera/perspective.h"
#include "waymark/features/feature_geometry.h"

namespace waymark {
namespace {

constexpr double kReadoutS = 0.03;
constexpr double kRange = 4.0;

class RollingShutterTest : public ::testing::Test {
 protected:
  RollingShutterTest() {
    motion_.turn_rad_s = {0.5f, -0.8f, 0.4f};
    motion_.shift_per_s = {0.3f, 0.2f, -0.4f};
    motion_.inverse_range = static_cast<float>(1.0 / kRange);
    Vector6d twist;
    twist << motion_.shift_per_s.cast<double>(), motion_.turn_rad_s.cast<double>();
    for (double x = 40.0; x < 600.0; x += 80.0) {
      for (double y = 30.0; y < 460.0; y += 60.0) add(twist, {x, y});
    }
    seen_.num_primary = seen_.keypoints.size();
    seen_.partner.assign(seen_.num_primary, kNoFeature);
    seen_.range_m.assign(seen_.num_primary, 0.0f);
    seen_.inverse_range_sigma.assign(seen_.num_primary, 0.0f);
    derive_geometry(global_, seen_);
  }

  Eigen::Vector2d project(const Eigen::Vector3d& point) const {
    const std::vector<Eigen::Vector3d> points = {point};
    std::vector<Eigen::Vector2d> pixels(1);
    std::vector<std::uint8_t> is_visible(1);
    camera_->project(points, pixels, is_visible);
    return pixels[0];
  }

  /// A point that would be seen at this pixel at the frame's time, where its row sees it.
  void add(const Vector6d& twist, const Eigen::Vector2d& pixel) {
    const std::vector<Eigen::Vector2d> pixels = {pixel};
    std::vector<Eigen::Vector3d> bearings(1);
    std::vector<std::uint8_t> is_valid(1);
    camera_->unproject(pixels, bearings, is_valid);
    Eigen::Vector2d seen = pixel;
    for (int k = 0; k < 5; ++k) {
      const double seconds = kReadoutS * row_delay(*camera_, static_cast<float>(seen.y()));
      seen = project(Rigid3::exp(seconds * twist) * (kRange * bearings[0]));
    }
    seen_.keypoints.push_back(
        {.x_px = static_cast<float>(seen.x()), .y_px = static_cast<float>(seen.y())});
    at_once_.push_back(pixel.cast<float>());
  }

  double largest_error_px(const Features& features) const {
    double largest = 0.0;
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Keypoint& keypoint = features.keypoints[i];
      const Eigen::Vector2f off = Eigen::Vector2f(keypoint.x_px, keypoint.y_px) - at_once_[i];
      largest = std::max(largest, double{off.norm()});
    }
    return largest;
  }

  const std::shared_ptr<const Camera> camera_ = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({420.0, 420.0}, {319.5, 239.5}, std::vector{-0.1, 0.01, 0.0, 0.0}),
      640,
      480);
  const Rig global_{{{camera_, Rigid3()}}};
  const Rig rolling_{{{camera_, Rigid3(), std::nullopt, nullptr, kReadoutS}}};
  RigMotion motion_;
  Features seen_;
  std::vector<Eigen::Vector2f> at_once_;
};

TEST_F(RollingShutterTest, RowsAreReadAroundTheFramesTime) {
  EXPECT_EQ(row_delay(*camera_, 0.0f), -0.5f);
  EXPECT_EQ(row_delay(*camera_, 239.5f), 0.0f);
  EXPECT_EQ(row_delay(*camera_, 479.0f), 0.5f);
}

TEST_F(RollingShutterTest, MovesFeaturesToWhereTheyWouldHaveBeenSeenAtOnce) {
  ASSERT_GT(largest_error_px(seen_), 6.0);
  EXPECT_TRUE(correct_rolling(rolling_, motion_, seen_));
  EXPECT_LT(largest_error_px(seen_), 0.3);
  EXPECT_EQ(seen_.motion, motion_);
}

TEST_F(RollingShutterTest, TheTurnAloneIsMostOfIt) {
  motion_.inverse_range = 0.0f;
  correct_rolling(rolling_, motion_, seen_);
  EXPECT_GT(largest_error_px(seen_), 0.5);
  EXPECT_LT(largest_error_px(seen_), 2.0);
}

TEST_F(RollingShutterTest, ReplacesACorrectionByAnother) {
  seen_.rig = std::make_shared<const Rig>(rolling_);
  const auto seen = std::make_shared<const Features>(seen_);
  RigMotion other = motion_;
  other.turn_rad_s *= 0.5f;
  const auto half = moved(seen, other);
  EXPECT_GT(largest_error_px(*half), 2.0);
  EXPECT_LT(largest_error_px(*moved(half, motion_)), 0.3);
  const auto bearing = [](const Features& features) { return features.bearings[3]; };
  EXPECT_NE(bearing(*half), bearing(*seen)) << "the geometry follows";
}

TEST_F(RollingShutterTest, AGlobalShutterBendsNothing) {
  const FeatureArray<Keypoint> before = seen_.keypoints;
  EXPECT_FALSE(correct_rolling(global_, motion_, seen_));
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(before[i].x_px, seen_.keypoints[i].x_px);
    EXPECT_EQ(before[i].y_px, seen_.keypoints[i].y_px);
  }
}

TEST_F(RollingShutterTest, IsNotCorrectedWhileTheMotionIsUnknown) {
  EXPECT_TRUE(correct_rolling(rolling_, motion_, seen_));
  EXPECT_TRUE(correct_rolling(rolling_, RigMotion{}, seen_));
  EXPECT_EQ(seen_.readout_s[0], 0.0f);
  EXPECT_FALSE(correct_rolling(rolling_, RigMotion{}, seen_));
}

TEST_F(RollingShutterTest, PointsBeyondInfinityOnlyTurn) {
  seen_.range_m.assign(seen_.size(), -50.0f);
  RigMotion turn;
  turn.turn_rad_s = motion_.turn_rad_s;
  const RigCamera& camera = rolling_.cameras[0];
  EXPECT_EQ(bearing_rate(motion_, camera, seen_, 0), bearing_rate(turn, camera, seen_, 0));
}

TEST_F(RollingShutterTest, IsUndoneByACalibrationWithoutReadout) {
  seen_.rig = std::make_shared<const Rig>(rolling_);
  const auto corrected = moved(std::make_shared<const Features>(seen_), motion_);
  const auto back = recompute(*corrected, std::make_shared<const Rig>(global_), corrected->motion);
  for (std::size_t i = 0; i < back->size(); ++i) {
    EXPECT_NEAR(back->keypoints[i].x_px, seen_.keypoints[i].x_px, 0.3f);
    EXPECT_NEAR(back->keypoints[i].y_px, seen_.keypoints[i].y_px, 0.3f);
  }
}

TEST_F(RollingShutterTest, CamerasBesideTheOriginMoveWithTheTurn) {
  const RigCamera beside{camera_, Rigid3(Eigen::Quaterniond::Identity(), {-0.5, 0.0, 0.0})};
  RigMotion turning;
  turning.turn_rad_s = {0.0f, 1.0f, 0.0f};
  const Eigen::Vector3d point(0.3, 0.2, 3.0);
  const auto bearing_at = [&](double seconds) -> Eigen::Vector3d {
    Vector6d twist = Vector6d::Zero();
    twist.tail<3>() = seconds * turning.turn_rad_s.cast<double>();
    return (beside.cam_from_rig * (Rigid3::exp(twist) * point)).normalized();
  };
  const Eigen::Vector3d expected = (bearing_at(1e-4) - bearing_at(-1e-4)) / 2e-4;
  const double range = (beside.cam_from_rig * point).norm();
  const Eigen::Vector3f rate =
      bearing_rate(turning, beside, bearing_at(0.0).cast<float>(), static_cast<float>(1.0 / range));
  EXPECT_LT((rate.cast<double>() - expected).norm(), 1e-5);
}

}  // namespace
}  // namespace waymark
