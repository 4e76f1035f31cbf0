// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibration/recalibrate.h"

#include <gtest/gtest.h>

#include "waymark/calibration/testing/calibration.h"
#include "waymark/map/parts.h"
#include "waymark/mapping/global_adjustment.h"

namespace waymark {
namespace {

class CalibrateTest : public ::testing::Test {
 protected:
  GlobalAdjustment adjust(std::shared_ptr<const Rig> truth,
                          const std::shared_ptr<const Rig>& told,
                          double pixel_sigma = 0.3,
                          double inverse_range_sigma = 0.0) {
    TestMap scene = look_around(std::move(truth), told, 16, pixel_sigma, inverse_range_sigma);
    const KnownCalibration known = KnownCalibration::as_given(told);
    return adjust_with_calibration(*scene.map.freeze(), known);
  }

  /// True value of a parameter less its estimate, in standard deviations; 1e9 without one.
  static double error_in_sigmas(const GlobalAdjustment& found,
                                std::string_view name,
                                double true_change) {
    if (!found.calibration) return 1e9;
    const auto& parameters = found.calibration->parameters;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      if (parameters[i].name != name) continue;
      return (true_change - found.calibration->change[at]) / found.calibration->sigma[at];
    }
    return 1e9;
  }
};

TEST_F(CalibrateTest, FindsTheFocalLength) {
  for (const int num_cameras : {1, 2}) {
    const auto truth = make_described(num_cameras, make_test_pinhole(420.0));
    const GlobalAdjustment found =
        adjust(truth, make_described(num_cameras, make_test_pinhole(441.0)));
    EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.fu", -21.0)), 3.0) << num_cameras;
    EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.fv", -21.0)), 3.0) << num_cameras;
  }
}

TEST_F(CalibrateTest, FindsTheFocalLengthThatADepthImageWasReadWith) {
  const auto fisheye = [](double focal_px) {
    CameraDescription description = make_test_pinhole(focal_px, {0.003, 0.0007, -0.002, 0.0002});
    description.distortion_model = "equidistant";
    return description;
  };
  for (const auto& [truth, told] : {std::pair(make_test_pinhole(420.0), make_test_pinhole(441.0)),
                                    std::pair(fisheye(200.0), fisheye(210.0))}) {
    const double change = truth.intrinsics[0] - told.intrinsics[0];
    const GlobalAdjustment found =
        adjust(make_described(1, truth), make_described(1, told), 0.3, 0.0005);
    EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.fu", change)), 3.0) << told.distortion_model;
    EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.fv", change)), 3.0) << told.distortion_model;
  }
}

TEST_F(CalibrateTest, FindsDistortion) {
  const GlobalAdjustment found =
      adjust(make_described(1, make_test_pinhole(420.0, {-0.2, 0.03, 0.0, 0.0})),
             make_described(1, make_test_pinhole(420.0)));
  EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.k1", -0.2)), 3.0);
  EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.k2", 0.03)), 3.0);
}

TEST_F(CalibrateTest, FindsTheTurnOfTheSecondCamera) {
  const GlobalAdjustment found = adjust(make_described(2, make_test_pinhole(420.0), 2e-3),
                                        make_described(2, make_test_pinhole(420.0)));
  EXPECT_LT(std::abs(error_in_sigmas(found, "cam1.turn_y", 2e-3)), 3.0);
}

TEST_F(CalibrateTest, FindsWhatTheBearingsOfAPairAreOffBy) {
  const auto truth = make_described(2, make_test_pinhole(420.0));
  Rig told = *truth;
  told.cameras[1].bearing_error.along_rad[2] = 5e-3;
  told.cameras[1].bearing_error.across_rad[3] = -8e-3;
  const GlobalAdjustment found = adjust(truth, std::make_shared<const Rig>(told));
  EXPECT_LT(std::abs(error_in_sigmas(found, "cam1.along_xx", -5e-3)), 3.0);
  EXPECT_LT(std::abs(error_in_sigmas(found, "cam1.across_xy", 8e-3)), 3.0);
}

TEST_F(CalibrateTest, LeavesWhatIsExact) {
  const auto truth = make_described(1, make_test_pinhole(420.0, {-0.2, 0.03, 0.0, 0.0}));
  Rig told = *make_described(1, make_test_pinhole(420.0));
  told.cameras[0].sigmas.intrinsics = {0.0, 0.0, 0.0, 0.0};
  const GlobalAdjustment found = adjust(truth, std::make_shared<const Rig>(told));
  ASSERT_TRUE(found.calibration);
  const CameraDescription& camera = *found.calibration->rig->cameras[0].description;
  EXPECT_EQ(camera.intrinsics, told.cameras[0].description->intrinsics);
  EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.k1", -0.2)), 3.0);
  EXPECT_EQ(found.calibration->sigma[0], 0.0);
  EXPECT_EQ(found.calibration->sigma[6], 5e-4) << "nothing is told of p1";
}

TEST_F(CalibrateTest, LearnsFromAllSubmapsTogether) {
  const auto truth = make_described(1, make_test_pinhole(420.0));
  const auto told = make_described(1, make_test_pinhole(432.0));
  const KnownCalibration known = KnownCalibration::as_given(told);
  TestMap part = look_around(truth, told, 5, 0.5);
  EXPECT_FALSE(adjust_with_calibration(*part.map.freeze(), known).calibration.has_value());
  Map all = unite(part.map, part.map);
  for (int i = 0; i < 6; ++i) all = unite(all, part.map);
  const GlobalAdjustment found = adjust_with_calibration(*all.freeze(), known);
  EXPECT_LT(std::abs(error_in_sigmas(found, "cam0.fu", -12.0)), 5.0);
}

TEST_F(CalibrateTest, LeavesWhatIsRight) {
  for (const int num_cameras : {1, 2}) {
    const auto truth = make_described(num_cameras, make_test_pinhole(420.0));
    EXPECT_FALSE(adjust(truth, truth).calibration.has_value());
  }
}

}  // namespace
}  // namespace waymark
