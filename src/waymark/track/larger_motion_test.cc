// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/larger_motion.h"

#include <gtest/gtest.h>

#include "waymark/base/rng.h"
#include "waymark/match/test_scene.h"

namespace waymark {
namespace {

constexpr double kFocalPx = 420.0;
constexpr std::size_t kNumOfWall = 120;
constexpr std::size_t kNumOfBox = 180;

/// A wall with a box before it, seen by a camera that moved, after the box has moved by itself.
class LargerMotionTest : public ::testing::Test {
 protected:
  void look(const Eigen::Vector3d& box_moved) {
    seen_.clear();
    Rng rng(3, 0);
    for (std::size_t i = 0; i < kNumOfWall + kNumOfBox; ++i) {
      const bool is_box = i >= kNumOfWall;
      const Eigen::Vector3d point =
          is_box ? Eigen::Vector3d(
                       rng.uniform(-0.3, 0.3), rng.uniform(-0.6, 0.6), rng.uniform(1.4, 1.6))
                 : Eigen::Vector3d(
                       rng.uniform(-3.0, 3.0), rng.uniform(-2.0, 2.0), rng.uniform(4.5, 5.5));
      const Eigen::Vector3d now = is_box ? Eigen::Vector3d(point + box_moved) : point;
      add(point, truth_ * now, rng);
    }
  }

  /// The pose after both steps, from where the camera was.
  Rigid3 locate() {
    PoseWorkspace workspace;
    const PoseEstimate first = optimize_pose(*rig_, seen_, Rigid3(), PoseOptions{}, workspace);
    first_pose_ = first.rig_from_world;
    return LargerMotion(rig_).find(seen_, Rigid3(), first).value_or(first_pose_);
  }

  double error_of(const Rigid3& pose) const { return (pose * truth_.inverse()).translation.norm(); }

  const std::shared_ptr<const Rig> rig_ = make_test_rig(1);
  const Rigid3 truth_ = Rigid3(Eigen::Quaterniond::Identity(), {-0.04, 0.0, -0.05});
  PoseObservations seen_;
  Rigid3 first_pose_;

 private:
  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& in_cam, Rng& rng) {
    const Eigen::Vector3d ray = in_cam.normalized();
    const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(ray).normalized();
    Eigen::Matrix<double, 2, 3> tangents;
    tangents << right.transpose(), ray.cross(right).transpose();
    const Eigen::Vector2d noise_px(rng.uniform(-0.8, 0.8), rng.uniform(-0.8, 0.8));
    const Eigen::Vector3d measured = ray + tangents.transpose() * noise_px / kFocalPx;
    seen_.point_in_world.push_back(point);
    seen_.bearing.push_back(measured.normalized().cast<float>());
    seen_.level_pixel_from_bearing.push_back((kFocalPx * tangents).cast<float>());
    seen_.camera.push_back(0);
  }
};

TEST_F(LargerMotionTest, IsThatOfTheWallBehindWhoeverWalks) {
  look({0.12, 0.0, 0.05});
  const Rigid3 pose = locate();
  EXPECT_GT(error_of(first_pose_), 0.04) << "most features are of the box";
  EXPECT_LT(error_of(pose), 0.02) << "by the contradicted ones only";
}

TEST_F(LargerMotionTest, IsTheFirstWhereNothingMovesByItself) {
  look(Eigen::Vector3d::Zero());
  const Rigid3 pose = locate();
  EXPECT_EQ(pose.translation, first_pose_.translation);
  EXPECT_LT(error_of(pose), 0.01);
}

TEST_F(LargerMotionTest, WrongMatchesAreNoMotion) {
  look(Eigen::Vector3d::Zero());
  Rng rng(4, 0);
  for (std::size_t i = 0; i < seen_.size(); i += 3) {
    seen_.point_in_world[i] += Eigen::Vector3d(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), 0.0);
  }
  const Rigid3 pose = locate();
  EXPECT_EQ(pose.translation, first_pose_.translation);
  EXPECT_LT(error_of(pose), 0.02);
}

}  // namespace
}  // namespace waymark
