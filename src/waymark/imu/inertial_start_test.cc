// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_start.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <tuple>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/geometry/bearing.h"
#include "waymark/imu/start_steps.h"
#include "waymark/imu/testing/imu_motion.h"

namespace waymark {
namespace {

using testing::ImuMotion;
using testing::nanoseconds;
using testing::normal_vector;

constexpr ImuNoise kStartNoise{2e-4, 3e-3, 3e-5, 1e-3};
constexpr int kNumPoses = 14;
constexpr double kPoseInterval = 0.35;

/// What is told besides poses and samples.
struct Told {
  bool has_extrinsics = true;
  bool has_time_shift = true;
};

/// A random IMU, map and motion; truth is drawn from what is believed before.
struct StartScene {
  ImuMotion motion;
  InertialSetup setup;
  ImuBiases biases;
  double time_shift_s = 0.0;
  InertialStartOptions options;
  ImuCalibration calibration;
  ImuSamples samples;
  std::vector<VisionPose> poses;

  StartScene(ImuMotion (*draw)(Rng&), Told told, Rng& rng) : motion(draw(rng)) {
    setup.gravity = kStandardGravity * normal_vector(rng).normalized();
    options.log_scale = 0.5;
    options.log_scale_sigma = 1.5;
    options.accelerometer_bias_sigma = 0.1;
    options.gyroscope_bias_sigma = 0.01;
    setup.log_scale = options.log_scale + options.log_scale_sigma * rng.normal();
    options.pose_position_sigma = 0.003 * std::exp(-setup.log_scale);
    options.pose_rotation_sigma = 0.001;
    biases = {options.gyroscope_bias_sigma * normal_vector(rng),
              options.accelerometer_bias_sigma * normal_vector(rng)};
    draw_calibration(told, rng);
    samples = testing::simulated_samples(motion,
                                         -0.5,
                                         kNumPoses * kPoseInterval + 0.5,
                                         200.0,
                                         kStartNoise,
                                         biases,
                                         setup.gravity,
                                         rng);
    for (int i = 0; i < kNumPoses; ++i) add_pose(i * kPoseInterval, rng);
  }

  void draw_calibration(Told told, Rng& rng) {
    const Eigen::Quaterniond rotation = so3_exp(1.5 * normal_vector(rng));
    const double arm_sigma =
        told.has_extrinsics ? options.told_lever_arm_sigma : options.lever_arm_sigma;
    const Eigen::Vector3d told_arm =
        told.has_extrinsics ? Eigen::Vector3d(0.1 * normal_vector(rng)) : Eigen::Vector3d::Zero();
    const Eigen::Vector3d arm = told_arm + arm_sigma * normal_vector(rng);
    setup.imu_from_rig = {rotation, -(rotation * arm)};
    if (told.has_extrinsics) {
      const Eigen::Quaterniond told_rotation =
          so3_exp(options.told_rotation_sigma * normal_vector(rng)) * rotation;
      calibration.imu_from_rig = Rigid3(told_rotation, -(told_rotation * told_arm));
    }
    options.time_shift_sigma_s = 0.04;
    const double told_shift = told.has_time_shift ? 0.03 : 0.0;
    const double shift_sigma =
        told.has_time_shift ? options.told_time_shift_sigma_s : options.time_shift_sigma_s;
    if (told.has_time_shift) calibration.time_shift_s = told_shift;
    time_shift_s = told_shift + shift_sigma * rng.normal();
  }

  void add_pose(double image_s, Rng& rng) {
    Vector6d error;
    error << options.pose_position_sigma * normal_vector(rng),
        options.pose_rotation_sigma * normal_vector(rng);
    poses.push_back({nanoseconds(image_s), Rigid3::exp(error) * true_pose(image_s)});
  }

  Rigid3 true_pose(double image_s) const {
    Rigid3 pose = (motion.world_from_imu(image_s + time_shift_s) * setup.imu_from_rig).inverse();
    pose.translation *= std::exp(-setup.log_scale);
    return pose;
  }

  std::optional<InertialStart> start() const {
    return start_inertial(samples, poses, calibration, kStartNoise, options);
  }
};

/// Errors in tangent vectors: (setup 10, biases 6).
using Vector16d = Eigen::Matrix<double, 16, 1>;

struct StartError {
  Vector16d error;
  Vector16d sigma;
};

StartError error_of(const InertialStart& found, const StartScene& scene) {
  StartError result;
  const Eigen::Vector3d down = found.setup.gravity.normalized();
  const Eigen::Vector3d true_down = scene.setup.gravity.normalized();
  const Eigen::Vector3d axis = true_down.cross(down).normalized();
  result.error.head<2>() = tangent_basis(down).transpose() * axis * angle_between(true_down, down);
  result.error[2] = found.setup.log_scale - scene.setup.log_scale;
  result.error.segment<6>(3) =
      (found.setup.imu_from_rig * scene.setup.imu_from_rig.inverse()).log();
  // Steps turn about the IMU, so that what is left of them is the error of the lever arm.
  result.error.segment<3>(3) =
      found.setup.imu_from_rig.rotation *
      (scene.setup.imu_from_rig.origin_in_source() - found.setup.imu_from_rig.origin_in_source());
  result.error[9] = found.time_shift_s - scene.time_shift_s;
  result.error.segment<3>(10) = found.states.back().biases.gyroscope - scene.biases.gyroscope;
  result.error.tail<3>() = found.states.back().biases.accelerometer - scene.biases.accelerometer;
  for (int i = 0; i < 10; ++i) result.sigma[i] = found.sigma(i);
  for (int i = 0; i < 6; ++i) result.sigma[10 + i] = found.sigma(19 + i);
  return result;
}

/// Normalised errors and standard deviations over random scenes, as root mean squares.
struct StartStatistics {
  Vector16d squared = Vector16d::Zero();
  Vector16d variance = Vector16d::Zero();
  double fit = 0.0;  ///< Squared error by what it should be.

  StartStatistics(ImuMotion (*draw)(Rng&), Told told, int num_trials = 40) {
    for (int trial = 0; trial < num_trials; ++trial) {
      Rng rng(7, static_cast<std::uint64_t>(trial));
      const StartScene scene(draw, told, rng);
      const auto found = scene.start();
      if (!found) {
        ADD_FAILURE() << trial;
        continue;
      }
      const StartError one = error_of(*found, scene);
      squared += one.error.cwiseQuotient(one.sigma).cwiseAbs2() / num_trials;
      variance += one.sigma.cwiseAbs2() / num_trials;
      fit += found->squared_error / found->degrees_of_freedom / num_trials;
    }
  }
  double normalised(int at, int size) const { return std::sqrt(squared.segment(at, size).mean()); }
  double sigma(int at, int size) const { return std::sqrt(variance.segment(at, size).mean()); }

  void expect_honest(const char* name) const {
    for (const auto& [part, at, size] : {std::tuple{"gravity", 0, 2},
                                         {"log scale", 2, 1},
                                         {"lever arm", 3, 3},
                                         {"rotation", 6, 3},
                                         {"time shift", 9, 1},
                                         {"gyroscope bias", 10, 3},
                                         {"accelerometer bias", 13, 3}}) {
      EXPECT_GT(normalised(at, size), 0.5) << part;
      EXPECT_LT(normalised(at, size), 2.0) << part;
      std::printf("%s, %s: %.2f standard deviations of %.2g\n",
                  name,
                  part,
                  normalised(at, size),
                  sigma(at, size));
    }
    EXPECT_NEAR(fit, 1.0, 0.15);
  }
};

ImuMotion motion_at_rest(Rng& rng) {
  ImuMotion motion;
  motion.attitude = so3_exp(normal_vector(rng));
  return motion;
}

TEST(InertialStart, InTheHandTellsAllWell) {
  const StartStatistics statistics(testing::hand_held_motion, {});
  statistics.expect_honest("in the hand");
  EXPECT_LT(statistics.sigma(2, 1), 0.005);
  EXPECT_LT(statistics.sigma(0, 2), 0.005);
  EXPECT_NEAR(statistics.normalised(2, 1), 1.0, 0.25);
}

TEST(InertialStart, InTheHandTellsMountingAndTimeShiftToo) {
  const StartStatistics statistics(testing::hand_held_motion, {false, false});
  statistics.expect_honest("in the hand, nothing told");
  EXPECT_LT(statistics.sigma(3, 3), 0.01);
  EXPECT_LT(statistics.sigma(6, 3), 0.002);
  EXPECT_LT(statistics.sigma(9, 1), 0.0005);
}

TEST(InertialStart, HoveringTellsLess) {
  const StartStatistics statistics(testing::hovering_motion, {false, false});
  statistics.expect_honest("hovering, nothing told");
  EXPECT_LT(statistics.sigma(2, 1), 0.05);
  EXPECT_LT(statistics.sigma(6, 3), 0.02);
}

TEST(InertialStart, OfACarHardlyTellsTheScaleAndSaysSo) {
  const StartStatistics statistics(testing::car_motion, {});
  statistics.expect_honest("car");
  EXPECT_GT(statistics.sigma(2, 1), 0.2);
  EXPECT_LT(statistics.sigma(0, 2), 0.02);  // What is down shows all the same.
}

TEST(InertialStart, AtRestTellsGravityButNoScale) {
  const StartStatistics statistics(motion_at_rest, {});
  statistics.expect_honest("at rest");
  EXPECT_GT(statistics.sigma(2, 1), 0.7);
  EXPECT_LT(statistics.sigma(0, 2), 0.02);
}

TEST(InertialStart, AtRestWithNothingToldSaysThatItKnowsNothing) {
  const StartStatistics statistics(motion_at_rest, {false, false}, 4);
  EXPECT_GT(statistics.sigma(2, 1), 0.7);
  EXPECT_GT(statistics.sigma(3, 3), 0.09);
  EXPECT_GT(statistics.sigma(6, 3), 0.5);
  EXPECT_GT(statistics.sigma(9, 1), 0.02);
}

TEST(InertialStart, AMetricMapTellsMore) {
  for (std::uint64_t trial = 0; trial < 5; ++trial) {
    Rng rng(8, trial);
    StartScene scene(testing::car_motion, {}, rng);
    scene.options.log_scale = scene.setup.log_scale;
    scene.options.log_scale_sigma = 0.01;
    const auto found = scene.start();
    ASSERT_TRUE(found);
    EXPECT_LT(found->sigma(2), 0.0101);
    const Eigen::Vector3d velocity = found->states.back().velocity;
    EXPECT_LT((velocity - scene.motion.drift).norm(), 0.03 * scene.motion.drift.norm());
    // The velocity is as unsure as the scale.
    const Eigen::Matrix3d covariance = found->covariance().block<3, 3>(16, 16);
    EXPECT_NEAR(std::sqrt(covariance.trace()), 0.01 * scene.motion.drift.norm(), 0.02);
  }
}

/// Three of the poses are only guessed, by half a metre and a third of a turn wrong.
TEST(InertialStart, FindsPosesThatAreNotSeen) {
  for (std::uint64_t trial = 0; trial < 5; ++trial) {
    Rng rng(10, trial);
    StartScene scene(testing::hand_held_motion, {}, rng);
    scene.options.log_scale = scene.setup.log_scale;
    scene.options.log_scale_sigma = 0.01;
    const double metre = std::exp(-scene.setup.log_scale);
    for (const std::size_t i : {5u, 6u, 7u}) {
      Vector6d off;
      off << 0.5 * metre * normal_vector(rng), normal_vector(rng);
      scene.poses[i].rig_from_world = Rigid3::exp(off) * scene.poses[i].rig_from_world;
      scene.poses[i].is_seen = false;
    }
    const auto found = scene.start();
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->squared_error / found->degrees_of_freedom, 1.0, 0.5);
    for (int i = 5; i < 8; ++i) {
      const Rigid3 truth = scene.true_pose(i * kPoseInterval);
      const Rigid3& pose = found->states[static_cast<std::size_t>(i)].rig_from_world;
      EXPECT_LT((pose.origin_in_source() - truth.origin_in_source()).norm(), 0.02 * metre) << i;
      EXPECT_LT(pose.rotation.angularDistance(truth.rotation), 0.005) << i;
    }
  }
}

TEST(InertialStart, LetsASinglePoseBeWrongWhereThatIsAllowed) {
  Rng rng(11, 0);
  StartScene scene(testing::hand_held_motion, {}, rng);
  Vector6d off;
  off << 100.0 * scene.options.pose_position_sigma * Vector6d::Ones().head<3>(),
      Eigen::Vector3d::Zero();
  scene.poses[6].rig_from_world = Rigid3::exp(off) * scene.poses[6].rig_from_world;
  EXPECT_TRUE(scene.start()->is_contradicted());
  scene.options.pose_huber = 2.0;
  const auto found = scene.start();
  ASSERT_TRUE(found);
  const Rigid3 truth = scene.true_pose(6 * kPoseInterval);
  EXPECT_LT((found->states[6].rig_from_world * truth.inverse()).log().head<3>().norm(),
            0.1 * off.norm());
}

TEST(InertialStart, GoesOnAcrossAGap) {
  Rng rng(9, 0);
  StartScene scene(testing::hand_held_motion, {}, rng);
  ImuSamples with_gap;
  for (const ImuSample& sample : scene.samples.all()) {
    const double t = 1e-9 * static_cast<double>(sample.timestamp_ns);
    if (t < 1.9 || t > 2.3) with_gap.add(sample);
  }
  scene.samples = with_gap;
  const auto found = scene.start();
  ASSERT_TRUE(found);
  const StartError one = error_of(*found, scene);
  EXPECT_LT(std::abs(one.error[2]), 4.0 * one.sigma[2]);
  EXPECT_LT(one.sigma[2], 0.02);
  EXPECT_LT(found->squared_error, 2.0 * found->degrees_of_freedom);
}

TEST(InertialStart, OutliersAmongTurnsDoNotSpoilTheMounting) {
  Rng rng(10, 0);
  StartScene scene(testing::hand_held_motion, {false, true}, rng);
  const auto found =
      rotation_start({scene.samples, scene.poses, scene.calibration, kStartNoise, scene.options});
  ASSERT_TRUE(found);
  EXPECT_LT(found->imu_from_rig.angularDistance(scene.setup.imu_from_rig.rotation), 0.005);
  EXPECT_LT((found->gyroscope_bias - scene.biases.gyroscope).norm(), 0.003);
  Rigid3& wrong = scene.poses[5].rig_from_world;
  wrong.rotation = so3_exp({0.2, -0.1, 0.1}) * wrong.rotation;
  const auto robust =
      rotation_start({scene.samples, scene.poses, scene.calibration, kStartNoise, scene.options});
  ASSERT_TRUE(robust);
  EXPECT_LT(robust->imu_from_rig.angularDistance(scene.setup.imu_from_rig.rotation), 0.03);
}

TEST(InertialStart, HoldsForTwoPosesAndForPosesThatAreNotFinite) {
  Rng rng(12, 0);
  StartScene scene(testing::hand_held_motion, {false, false}, rng);
  StartScene few = scene;
  few.poses.resize(2);
  const auto found = few.start();
  ASSERT_TRUE(found);
  EXPECT_GT(found->sigma(2), 0.1);
  scene.poses[3].rig_from_world.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(scene.start());
}

TEST(InertialStart, WithoutSamplesThereIsNone) {
  Rng rng(11, 0);
  StartScene scene(testing::hand_held_motion, {}, rng);
  scene.poses.resize(1);
  EXPECT_FALSE(scene.start());
  scene.samples = ImuSamples();
  EXPECT_FALSE(scene.start());
}

}  // namespace
}  // namespace waymark
