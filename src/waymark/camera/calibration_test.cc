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
  ASSERT_EQ(names.size(), std::size_t{2 * 8 + 5});
  EXPECT_EQ(names.front(), "cam0.fu");
  EXPECT_EQ(names[4], "cam0.k1") << "an undistorted camera may turn out to be distorted";
  EXPECT_EQ(names[16], "cam1.turn_x");
  EXPECT_EQ(names_of(CalibrationParameters(
                rig_of(described("ds", {-0.2, 0.6, 300.0, 300.0, 320.0, 240.0})))),
            (std::vector<std::string>{
                "cam0.shape1", "cam0.shape2", "cam0.fu", "cam0.fv", "cam0.pu", "cam0.pv"}));
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
  change[17] = 2e-3;  // cam1.turn_y
  change[19] = 1e-3;
  const std::optional<Rig> changed = parameters.rig_at(change);
  ASSERT_TRUE(changed.has_value());
  EXPECT_EQ(changed->cameras[0].description->intrinsics[0], 410.0);
  EXPECT_EQ(changed->cameras[0].description->distortion_coeffs[0], -0.1);
  const Rigid3& turned = changed->cameras[1].cam_from_rig;
  EXPECT_NEAR(so3_log(turned.rotation).y(), 2e-3, 1e-12);
  EXPECT_NEAR(turned.translation.norm(), 0.1, 1e-12) << "the baseline keeps its length";
  change[0] = -500.0;
  EXPECT_FALSE(parameters.rig_at(change).has_value()) << "there is no such camera";
}

TEST(CalibrationParameters, GiveTheDerivativeOfThePixel) {
  const Rig rig = rig_of(
      described("pinhole", {400.0, 410.0, 320.0, 240.0}, "radtan", {-0.2, 0.05, 0.001, 0.002}));
  const CalibrationParameters parameters(rig);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(8);
  const std::vector<Eigen::Vector3d> bearings = {Eigen::Vector3d(0.3, -0.2, 1.0).normalized(),
                                                 -Eigen::Vector3d::UnitZ()};
  const auto derivatives = parameters.pixel_by_intrinsics(0, zero, bearings);
  ASSERT_TRUE(derivatives.has_value());
  ASSERT_EQ(derivatives->size(), std::size_t{2 * 2 * 8});
  const double r2 = 0.13;
  const double radial = 1.0 - 0.2 * r2 + 0.05 * r2 * r2;
  const double x = 0.3 * radial + 2.0 * 0.001 * 0.3 * -0.2 + 0.002 * (r2 + 2.0 * 0.09);
  EXPECT_NEAR((*derivatives)[0], x, 1e-8) << "u by fu";
  EXPECT_NEAR((*derivatives)[1], 0.0, 1e-8) << "v by fu";
  EXPECT_NEAR((*derivatives)[8], 400.0 * 0.3 * r2, 1e-6) << "u by k1";
  EXPECT_NEAR((*derivatives)[9], 410.0 * -0.2 * r2, 1e-6) << "v by k1";
  for (std::size_t i = 16; i < 32; ++i) EXPECT_EQ((*derivatives)[i], 0.0) << "behind the camera";
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
  EXPECT_EQ(sigmas[4], 0.01) << "nothing is said of distortion";
  EXPECT_EQ(sigmas[16], 5e-4) << "nor of the turn";
  EXPECT_EQ(sigmas[20], 0.02);
  const std::vector<CalibrationSigmas> again = parameters.by_camera(sigmas);
  EXPECT_EQ(again[0].intrinsics, chain.cameras[0].sigmas.intrinsics);
  EXPECT_EQ(again[1].distortion_coeffs.size(), 4u);
  EXPECT_EQ(again[1].rotation_rad, (std::vector<double>{5e-4, 5e-4, 5e-4}));
  EXPECT_EQ(again[1].baseline_direction_rad, chain.cameras[1].sigmas.baseline_direction_rad);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(21);
  const std::vector<std::uint8_t> all_free(21, 1);
  EXPECT_GT(parameters.prior_information(zero, all_free)(2, 2), 1e6) << "it is exact";
}

TEST(CalibrationParameters, AreHeldLessTheFurtherTheyAreOff) {
  const CalibrationParameters parameters(
      rig_of(described("pinhole", {400.0, 400.0, 320.0, 240.0})));
  Eigen::VectorXd change = Eigen::VectorXd::Zero(8);
  const std::vector<std::uint8_t> is_free(8, 1);
  const double near = parameters.prior_information(change, is_free)(4, 4);
  change[4] = 10.0 * parameters.list()[4].prior_sigma;
  EXPECT_NEAR(parameters.prior_information(change, is_free)(4, 4), near / 101.0, 1e-9 * near);
  const std::vector<std::uint8_t> none_free(8, 0);
  EXPECT_GT(parameters.prior_information(change, none_free)(4, 4), 1e6 * near);
}

}  // namespace
}  // namespace waymark
