// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/inertial_bundle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/bearing.h"
#include "waymark/imu/testing/imu_motion.h"
#include "waymark/map/align.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

using testing::normal_vector;

constexpr std::uint32_t kNumPosed = 40;
constexpr double kInterval_s = 0.1;  // Of TestMap.
constexpr ImuNoise kNoise{2e-4, 3e-3, 3e-5, 1e-3};

/// Keyframes of a camera in the hand that carries an IMU, amid a cloud.
class InertialBundleTest : public ::testing::Test {
 protected:
  InertialBundleTest()
      : scene_(1, scatter_in({-6, -6, -6}, {6, 6, 6}, 6000, 3.0, 3), {.seed = 9}, false),
        motion_(testing::hand_held_motion(rng_)),
        samples_(samples_of(motion_)) {
    for (std::uint32_t k = 0; k < kNumPosed; ++k) {
      scene_.add_keyframe(world_from_rig(k));
      keyframes_.push_back(KeyframeId{k});
    }
    found_.setup.gravity = gravity_;
    found_.setup.imu_from_rig = imu_from_rig_;
    found_.states.resize(1);
    found_.covariances = {1e-6 * Matrix25d::Identity()};
  }

  ImuSamples samples_of(const testing::ImuMotion& motion) {
    return testing::simulated_samples(
        motion, -0.1, kNumPosed * kInterval_s, 200.0, kNoise, biases_, gravity_, rng_);
  }

  Rigid3 world_from_rig(std::uint32_t keyframe) const {
    return motion_.world_from_imu(kInterval_s * keyframe) * imu_from_rig_;
  }

  BundleProblem problem() const {
    BundleProblem problem;
    for (const KeyframeId id : keyframes_) {
      problem.rig_from_world.push_back(scene_.map.keyframes().at(id).rig_from_world);
    }
    add_inertial_terms(scene_.map, keyframes_, {samples_, kNoise, found_}, problem);
    return problem;
  }

  /// Adjusts the map, and gives how large it is for the truth.
  double adjusted_scale() {
    const GlobalAdjustment adjustment =
        adjust_with_imu(*scene_.map.freeze(), scene_.submap, {samples_, kNoise, found_});
    has_moved_ = !adjustment.correction.keyframes.empty();
    DirtyLandmarks dirty;
    apply_adjustment(scene_.map, adjustment, dirty);
    double is = 0.0, should_be = 0.0;
    for (std::uint32_t k = 0; k + 1 < kNumPosed; ++k) {
      is += (place_of(k + 1) - place_of(0)).norm();
      should_be += (world_from_rig(k + 1).translation - world_from_rig(0).translation).norm();
    }
    return is / should_be;
  }

  Eigen::Vector3d place_of(std::uint32_t keyframe) const {
    return scene_.map.keyframes().at(KeyframeId{keyframe}).rig_from_world.origin_in_source();
  }

  Rng rng_ = Rng(5, 0);
  const Eigen::Vector3d gravity_ = kStandardGravity * normal_vector(rng_).normalized();
  const Rigid3 imu_from_rig_{so3_exp({0.3, -0.2, 0.9}), {0.02, -0.05, 0.03}};
  const ImuBiases biases_{{0.01, -0.02, 0.005}, {0.05, 0.1, -0.03}};
  TestMap scene_;
  const testing::ImuMotion motion_;
  ImuSamples samples_;
  std::vector<KeyframeId> keyframes_;
  InertialStart found_;
  bool has_moved_ = false;
};

TEST_F(InertialBundleTest, DerivativesAreThoseOfTheResiduals) {
  const BundleProblem at = problem();
  const BundleMotion& motion = *at.motion;
  ASSERT_EQ(motion.terms.size(), kNumPosed - 1);
  constexpr double kStep = 1e-6;
  const std::size_t term = 7;
  const auto rows = motion.rows(term, at.rig_from_world, motion.unknowns);
  for (Eigen::Index column = 0; column < rows.by_blocks.cols(); ++column) {
    std::vector<Rigid3> poses = at.rig_from_world;
    std::vector<Vector6d> unknowns = motion.unknowns;
    const auto block = static_cast<std::size_t>(column / 6);
    const Vector6d step = kStep * Vector6d::Unit(column % 6);
    if (block < BundleMotion::kNumPoses) {
      Rigid3& pose = poses[motion.terms[term].poses[block]];
      pose = Rigid3::exp(step) * pose;
    } else {
      unknowns[motion.terms[term].unknowns[block - BundleMotion::kNumPoses]] += step;
    }
    const auto moved = motion.rows(term, poses, unknowns);
    const Eigen::VectorXd numeric = (moved.residual - rows.residual) / kStep;
    const double size = 1.0 + rows.by_blocks.col(column).norm();
    EXPECT_LT((numeric - rows.by_blocks.col(column)).norm(), 1e-3 * size) << column;
  }
}

TEST_F(InertialBundleTest, SamplesTellTheSizeOfTheMap) {
  transform_submap(scene_.map, scene_.submap, Sim3({1.0, 0.0, 0.0, 0.0}, {0, 0, 0}, 1.05));
  EXPECT_NEAR(adjusted_scale(), 1.0, 0.005);
}

TEST_F(InertialBundleTest, GravityAndMountingNeedNotBeFoundWell) {
  found_.setup.gravity = so3_exp({0.01, 0.02, -0.01}) * gravity_;
  found_.setup.imu_from_rig = Rigid3::exp(0.003 * Vector6d::Ones()) * imu_from_rig_;
  found_.covariances = {1e-5 * Matrix25d::Identity()};
  EXPECT_NEAR(adjusted_scale(), 1.0, 0.005);
}

TEST_F(InertialBundleTest, NothingMovesWhereSamplesAreOfAnotherMotion) {
  samples_ = samples_of(testing::hand_held_motion(rng_));
  EXPECT_NEAR(adjusted_scale(), 1.0, 1e-9);
  EXPECT_FALSE(has_moved_);
}

TEST_F(InertialBundleTest, KeyframesWithoutSamplesBetweenAreNotTied) {
  ImuSamples some;
  for (const ImuSample& sample : samples_.all()) {
    if (sample.timestamp_ns < 1'000'000'000 || sample.timestamp_ns > 2'000'000'000) {
      some.add(sample);
    }
  }
  samples_ = some;
  EXPECT_EQ(problem().motion->terms.size(), kNumPosed - 1 - 12);
}

}  // namespace
}  // namespace waymark
