// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/calibration.h"

#include <gtest/gtest.h>

#include "waymark/camera/camchain.h"

namespace waymark {
namespace {

CameraDescription described(std::string model,
                            std::vector<double> intrinsics,
                            std::string distortion = "none",
                            std::vector<double> coeffs = {}) {
  return {std::move(model),
          std::move(intrinsics),
          std::move(distortion),
          std::move(coeffs),
          640,
          480,
          "test"};
}

Rig rig_of(const CameraDescription& description, int num_cameras = 1) {
  CameraChain chain;
  for (int i = 0; i < num_cameras; ++i) {
    chain.cameras.push_back({description, {Eigen::Quaterniond::Identity(), {-0.1 * i, 0.0, 0.0}}});
  }
  return make_rig(chain);
}

std::vector<std::string> names_of(const CalibrationParameters& parameters) {
  std::vector<std::string> names;
  for (const CalibrationParameter& parameter : parameters.list()) names.push_back(parameter.name);
  return names;
}

TEST(CalibrationParameters, AreThoseOfTheModelAndTheRig) {
  const Rig rig = rig_of(described("pinhole", {400.0, 400.0, 320.0, 240.0}), 2);
  const CalibrationParameters parameters(rig);
  const std::vector<std::string> names = names_of(parameters);
  ASSERT_EQ(names.size(), std::size_t{2 * (8 + 1) + 10 + 5});
  EXPECT_EQ(names.front(), "cam0.fu");
  EXPECT_EQ(names[4], "cam0.k1") << "an undistorted camera may turn out to be distorted";
  EXPECT_EQ(names[8], "readout_ms");
  EXPECT_EQ(names[17], "cam1.along_x");
  EXPECT_EQ(names[27], "cam1.readout_ms");
  EXPECT_EQ(names[28], "cam1.turn_x");
  EXPECT_EQ(names_of(CalibrationParameters(
                rig_of(described("ds", {-0.2, 0.6, 300.0, 300.0, 320.0, 240.0})))),
            (std::vector<std::string>{"cam0.shape1",
                                      "cam0.shape2",
                                      "cam0.fu",
                                      "cam0.fv",
                                      "cam0.pu",
                                      "cam0.pv",
                                      "readout_ms",
                                      "depth.inverse_offset"}));
}

TEST(CalibrationParameters, LackWhatCannotBeMadeAnew) {
  Rig rig = rig_of(described("pinhole", {400.0, 400.0, 320.0, 240.0}));
  rig.cameras[0].remake = nullptr;
  EXPECT_EQ(CalibrationParameters(rig).size(), 0u);
}

TEST(CalibrationParameters, ChangeTheRig) {
  const Rig rig = rig_of(described("pinhole", {400.0, 400.0, 320.0, 240.0}), 2);
  const CalibrationParameters parameters(rig);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
  change[0] = 10.0;
  change[4] = -0.1;
  change[8] = 20.0;   // readout_ms
  change[19] = 3e-3;  // cam1.along_xx
  change[29] = 2e-3;  // cam1.turn_y
  change[31] = 1e-3;
  const std::optional<Rig> changed = parameters.rig_at(change);
  ASSERT_TRUE(changed.has_value());
  EXPECT_EQ(changed->cameras[0].description->intrinsics[0], 410.0);
  EXPECT_EQ(changed->cameras[0].description->distortion_coeffs[0], -0.1);
  const Rigid3& turned = changed->cameras[1].cam_from_rig;
  EXPECT_NEAR(so3_log(turned.rotation).y(), 2e-3, 1e-12);
  EXPECT_NEAR(turned.translation.norm(), 0.1, 1e-12) << "the baseline keeps its length";
  EXPECT_EQ(changed->cameras[1].bearing_error.along_rad[2], 3e-3);
  EXPECT_EQ(changed->cameras[0].readout_s, 0.02);
  change[0] = -500.0;
  EXPECT_FALSE(parameters.rig_at(change).has_value()) << "there is no such camera";
}

TEST(CalibrationParameters, ChangeTheOffsetOfDepths) {
  const Rig rig =
      with_depth_offset(rig_of(described("pinhole", {400.0, 400.0, 320.0, 240.0})), 0.01);
  const CalibrationParameters parameters(rig);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(10);
  change[9] = 0.02;
  EXPECT_DOUBLE_EQ(parameters.rig_at(change)->inverse_depth_offset, 0.03);
  EXPECT_EQ(parameters.list()[9].given, 0.01);
}

TEST(CalibrationParameters, GiveTheDerivativeOfThePixel) {
  const Rig rig = rig_of(
      described("pinhole", {400.0, 410.0, 320.0, 240.0}, "radtan", {-0.2, 0.05, 0.001, 0.002}));
  const CalibrationParameters parameters(rig);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(10);
  const std::vector<Eigen::Vector3d> bearings = {Eigen::Vector3d(0.3, -0.2, 1.0).normalized(),
                                                 -Eigen::Vector3d::UnitZ()};
  const auto derivatives = parameters.pixel_by_intrinsics(0, zero, bearings);
  ASSERT_TRUE(derivatives.has_value());
  ASSERT_EQ(derivatives->size(), std::size_t{2 * 2 * 10});
  const double r2 = 0.13;
  const double radial = 1.0 - 0.2 * r2 + 0.05 * r2 * r2;
  const double x = 0.3 * radial + 2.0 * 0.001 * 0.3 * -0.2 + 0.002 * (r2 + 2.0 * 0.09);
  EXPECT_NEAR((*derivatives)[0], x, 1e-8) << "u by fu";
  EXPECT_NEAR((*derivatives)[1], 0.0, 1e-8) << "v by fu";
  EXPECT_NEAR((*derivatives)[8], 400.0 * 0.3 * r2, 1e-6) << "u by k1";
  EXPECT_NEAR((*derivatives)[9], 410.0 * -0.2 * r2, 1e-6) << "v by k1";
  for (std::size_t i = 20; i < 40; ++i) EXPECT_EQ((*derivatives)[i], 0.0) << "behind the camera";
}

TEST(CalibrationParameters, AreAsSureAsTheCalibrationSays) {
  CameraChain chain;
  const CameraDescription camera = described("pinhole", {400.0, 400.0, 320.0, 240.0});
  chain.cameras.push_back({camera, Rigid3()});
  chain.cameras.push_back({camera, {Eigen::Quaterniond::Identity(), {-0.1, 0.0, 0.0}}});
  chain.cameras[0].sigmas.intrinsics = {0.1, 0.2, 0.0, 4.0};
  chain.cameras[1].sigmas.baseline_direction_rad = {0.01, 0.02};
  const CalibrationParameters parameters(make_rig(chain));
  std::vector<double> sigmas;
  for (const CalibrationParameter& each : parameters.list()) sigmas.push_back(each.prior_sigma);
  EXPECT_EQ(sigmas[0], 0.1);
  EXPECT_EQ(sigmas[2], 0.0);
  EXPECT_EQ(sigmas[4], 0.02) << "nothing is said of distortion";
  EXPECT_EQ(sigmas[28], 1e-3) << "nor of the turn";
  EXPECT_EQ(sigmas[32], 0.02);
  const std::vector<CalibrationSigmas> again = parameters.by_camera(sigmas);
  EXPECT_EQ(again[0].intrinsics, chain.cameras[0].sigmas.intrinsics);
  EXPECT_EQ(again[1].distortion_coeffs.size(), 4u);
  EXPECT_EQ(again[1].rotation_rad, (std::vector<double>{1e-3, 1e-3, 1e-3}));
  EXPECT_EQ(again[1].baseline_direction_rad, chain.cameras[1].sigmas.baseline_direction_rad);
  EXPECT_GT(parameters.prior_information(sigmas)(2, 2), 1e6) << "it is exact";
}

TEST(CalibrationParameters, DifferentiateByErrorsOfBearings) {
  const Rig rig = rig_of(described("pinhole", {400.0, 410.0, 320.0, 240.0}), 2);
  const CalibrationParameters parameters(rig);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
  const std::vector<Eigen::Vector3d> bearings = {Eigen::Vector3d(0.3, -0.2, 1.0).normalized()};
  const auto derivatives = parameters.pixel_by_intrinsics(1, zero, bearings);
  ASSERT_TRUE(derivatives.has_value());
  ASSERT_EQ(derivatives->size(), std::size_t{2 * 19});
  // The epipolar line of a parallel pair is a row; near points are further to the left.
  const Eigen::Vector3d& bearing = bearings[0];
  const double x = bearing.x();
  EXPECT_LT((*derivatives)[16], 0.0) << "u by along_x";
  EXPECT_NEAR((*derivatives)[17], 0.0, 1e-9) << "v by along_x";
  EXPECT_NEAR((*derivatives)[20] / (*derivatives)[16], x, 1e-9) << "along_xx by along_x";
  BearingError error;
  error.along_rad[0] = 1e-6;
  const Eigen::Vector3d toward = (-Eigen::Vector3d::UnitX() + x * bearing).normalized();
  const std::vector<Eigen::Vector3d> off = {bearing + error.at(bearing)[0] * toward};
  std::vector<Eigen::Vector2d> before(1), after(1);
  std::vector<std::uint8_t> is_visible(1);
  rig.cameras[1].camera->project(bearings, before, is_visible);
  rig.cameras[1].camera->project(off, after, is_visible);
  EXPECT_NEAR((*derivatives)[16], (after[0] - before[0]).x() / 1e-6, 1e-2);
}

TEST(CalibrationParameters, AreHeldByAStandardDeviationOfZero) {
  const CalibrationParameters parameters(
      rig_of(described("pinhole", {400.0, 400.0, 320.0, 240.0})));
  std::vector<double> sigmas(10, 0.1);
  const double near = parameters.prior_information(sigmas)(4, 4);
  EXPECT_NEAR(near, 100.0, 1e-9);
  sigmas[4] = 0.0;
  EXPECT_GT(parameters.prior_information(sigmas)(4, 4), 1e6 * near);
}

}  // namespace
}  // namespace waymark
