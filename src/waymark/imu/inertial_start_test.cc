// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/inertial_start.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>

#include "waymark/base/rng.h"
#include "waymark/geometry/bearing.h"
#include "waymark/imu/testing/imu_motion.h"

namespace waymark {
namespace {

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
  testing::ImuMotion motion;
  InertialSetup setup;
  ImuBiases biases;
  double time_shift_s = 0.0;
  InertialStartOptions options;
  ImuCalibration calibration;
  ImuSamples samples;
  std::vector<VisionPose> poses;

  StartScene(testing::ImuMotion (*draw)(Rng&), Told told, Rng& rng) : motion(draw(rng)) {
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
    samples = testing::simulated_samples(
        motion, -0.5, kNumPoses * kPoseInterval + 0.5, 200.0, kStartNoise, biases, setup.gravity,
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
  result.error.segment<3>(3) = found.setup.imu_from_rig.rotation *
                               (scene.setup.imu_from_rig.origin_in_source() -
                                found.setup.imu_from_rig.origin_in_source());
  result.error[9] = found.time_shift_s - scene.time_shift_s;
  result.error.segment<3>(10) = found.states.back().biases.gyroscope - scene.biases.gyroscope;
  result.error.tail<3>() = found.states.back().biases.accelerometer - scene.biases.accelerometer;
  for (int i = 0; i < 10; ++i) result.sigma[i] = found.sigma(i);
  for (int i = 0; i < 6; ++i) result.sigma[10 + i] = found.sigma(19 + i);
  return result;
}

constexpr std::array<std::pair<const char*, std::pair<int, int>>, 7> kParts{{
    {"gravity", {0, 2}},
    {"log scale", {2, 1}},
    {"lever arm", {3, 3}},
    {"rotation", {6, 3}},
    {"time shift", {9, 1}},
    {"gyroscope bias", {10, 3}},
    {"accelerometer bias", {13, 3}},
}};

/// RMS of normalised errors and of standard deviations over 40 scenes, by part.
struct StartStatistics {
  Vector16d squared = Vector16d::Zero();
  Vector16d variance = Vector16d::Zero();
  double squared_error_per_freedom = 0.0;

  StartStatistics(testing::ImuMotion (*draw)(Rng&), Told told, const char* name) {
    constexpr int kTrials = 40;
    for (int trial = 0; trial < kTrials; ++trial) {
      Rng rng(7, static_cast<std::uint64_t>(trial));
      const StartScene scene(draw, told, rng);
      const auto found = scene.start();
      if (!found) {
        ADD_FAILURE() << trial;
        continue;
      }
      const StartError one = error_of(*found, scene);
      squared += one.error.cwiseQuotient(one.sigma).cwiseAbs2() / kTrials;
      variance += one.sigma.cwiseAbs2() / kTrials;
      squared_error_per_freedom += found->squared_error / found->degrees_of_freedom / kTrials;
      if (std::getenv("TRIALS")) {
        std::cout << trial << " scale " << one.error[2] << " +- " << one.sigma[2] << " chi2 "
                  << found->squared_error / found->degrees_of_freedom << " shift " << one.error[9]
                  << " +- " << one.sigma[9] << " rot " << one.error.segment<3>(6).transpose()
                  << " +- " << one.sigma.segment<3>(6).transpose() << "\n";
      }
    }
    for (const auto& [part, where] : kParts) {
      const auto [at, size] = where;
      const double normalised = std::sqrt(squared.segment(at, size).mean());
      std::cout << name << " " << part << ": " << normalised << " of "
                << std::sqrt(variance.segment(at, size).mean()) << "\n";
    }
    std::cout << name << " fit " << squared_error_per_freedom << "\n";
  }
  double normalised(int at, int size) const {
    return std::sqrt(squared.segment(at, size).mean());
  }
  double sigma(int at, int size) const { return std::sqrt(variance.segment(at, size).mean()); }
};

testing::ImuMotion motion_at_rest(Rng& rng) {
  testing::ImuMotion motion;
  motion.attitude = so3_exp(normal_vector(rng));
  return motion;
}

TEST(InertialStart, HandHeldWithAllTold) {
  StartStatistics statistics(testing::hand_held_motion, {}, "hand");
}
TEST(InertialStart, HandHeldWithNothingTold) {
  StartStatistics statistics(testing::hand_held_motion, {false, false}, "hand unknown");
}
TEST(InertialStart, Hovering) {
  StartStatistics statistics(testing::hovering_motion, {true, false}, "hover");
}
TEST(InertialStart, Car) { StartStatistics statistics(testing::car_motion, {}, "car"); }
TEST(InertialStart, SmoothCar) { StartStatistics statistics([](Rng& rng) { auto m = testing::car_motion(rng); for (auto& a : m.position.amplitudes) a *= 0.1; return m; }, {}, "smooth car"); }
TEST(InertialStart, RestUnknown) { StartStatistics statistics(motion_at_rest, {false, false}, "rest unknown"); }
TEST(InertialStart, HoverUnknown) { StartStatistics statistics(testing::hovering_motion, {false, false}, "hover unknown"); }
TEST(InertialStart, CarUnknown) { StartStatistics statistics(testing::car_motion, {false, false}, "car unknown"); }
TEST(InertialStart, Rest) { StartStatistics statistics(motion_at_rest, {}, "rest"); }

}  // namespace
}  // namespace waymark
