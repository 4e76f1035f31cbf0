// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/registry.h"

#include <gmock/gmock.h>

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/testing/errors.h"
#include "waymark/camera/model_camera.h"
#include "waymark/camera/perspective.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/camera/rig.h"
#include "waymark/camera/testing/camera_test.h"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::input_error_of;
using ::testing::StartsWith;

CameraDescription euroc() {
  CameraDescription description;
  description.camera_model = "pinhole";
  description.intrinsics = {458.654, 457.296, 367.215, 248.375};
  description.distortion_model = "radtan";
  description.distortion_coeffs = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  description.width_px = 752;
  description.height_px = 480;
  description.where = "a.yaml:1: cam0";
  return description;
}

std::string error_of(const CameraDescription& description) {
  try {
    CameraRegistry::with_builtin_models().make_camera(description);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

template <class Change>
std::string error_after(Change&& change) {
  CameraDescription description = euroc();
  change(description);
  return error_of(description);
}

TEST(CameraRegistry, MakesAPerspectiveCamera) {
  const auto camera = CameraRegistry::with_builtin_models().make_camera(euroc());
  EXPECT_EQ(camera->model(), "pinhole");
  EXPECT_EQ(camera->width_px(), 752);
  EXPECT_EQ(camera->height_px(), 480);
  EXPECT_EQ(camera->wrap_width_px(), 0.0);
  const auto* perspective = dynamic_cast<const PerspectiveCamera*>(camera.get());
  ASSERT_NE(perspective, nullptr);
  EXPECT_EQ(perspective->parameters().focal_px(), Eigen::Vector2d(458.654, 457.296));
  const CameraTestProjection ahead = project_for_test(*camera, {{0.0, 0.0, 2.0}});
  EXPECT_EQ(ahead.pixels[0], Eigen::Vector2d(367.215, 248.375));
}

TEST(CameraRegistry, EachFaultHasItsMessage) {
  const auto message = [](auto&& change) { return error_after(change); };
  EXPECT_EQ(message([](auto& d) { d.camera_model = "pinhol"; }),
            "a.yaml:1: cam0: camera_model is pinhol, expected one of: division, ds, "
            "equirectangular, eucm, omni, pinhole");
  EXPECT_EQ(message([](auto& d) { d.intrinsics.pop_back(); }),
            "a.yaml:1: cam0: intrinsics has 3 numbers, expected 4: fu fv pu pv");
  EXPECT_EQ(message([](auto& d) { d.intrinsics[1] = -3.0; }),
            "a.yaml:1: cam0: focal length fv is -3, expected more than 0");
  EXPECT_THAT(message([](auto& d) { d.intrinsics[0] = 0.0; }), HasSubstr("focal length fu is 0"));
  EXPECT_THAT(message([](auto& d) { d.intrinsics[2] = std::nan(""); }),
              HasSubstr("intrinsics holds nan"));
  EXPECT_THAT(message([](auto& d) { d.distortion_coeffs[0] = INFINITY; }),
              HasSubstr("distortion_coeffs holds inf"));
  EXPECT_THAT(message([](auto& d) { d.distortion_coeffs.resize(6); }),
              HasSubstr("distortion_coeffs has 6 numbers, expected 4, 5 or 8"));
  EXPECT_THAT(message([](auto& d) { d.distortion_model = "plumb_bob"; }),
              HasSubstr("distortion_model is plumb_bob, expected radtan, equidistant or none"));
  EXPECT_THAT(message([](auto& d) { d.distortion_model = "none"; }),
              HasSubstr("distortion_coeffs has 4 numbers, expected none"));
  EXPECT_THAT(message([](auto& d) { d.width_px = 0; }),
              HasSubstr("resolution is [0, 480], expected width and height from 16 to 20000"));
  EXPECT_THAT(message([](auto& d) { d.height_px = 1000000; }), HasSubstr("resolution is"));
}

TEST(CameraRegistry, DistortionThatFoldsBackInTheImageIsRefused) {
  EXPECT_THAT(error_after([](auto& d) {
                d.distortion_coeffs = {-0.9, 0.0, 0.0, 0.0};
              }),
              AllOf(StartsWith("a.yaml:1: cam0: distortion_coeffs fold the image back at 18"),
                    HasSubstr("% of the pixels without a direction")));
  // The fold of x - 0.2 x^3, at 0.86 of the focal length, is outside of this image.
  EXPECT_EQ(error_after([](auto& d) {
              d.distortion_coeffs = {-0.2, 0.0, 0.0, 0.0};
              d.width_px = 640;
            }),
            "no error");
}

TEST(CameraRegistry, DistortionThatFoldsBackInTheCornersIsNot) {
  CameraDescription wide{
      "pinhole", {265.0, 265.0, 187.5, 119.5}, "radtan", {-0.35, 0.05, 0.0, 0.0}, 376, 240, "a"};
  const auto camera = CameraRegistry::with_builtin_models().make_camera(wide);
  EXPECT_GT(part_without_bearing(*camera), 0.05);
  EXPECT_LT(part_without_bearing(*camera), 0.12);
}

CameraDescription describe(const std::string& model, std::vector<double> intrinsics) {
  CameraDescription description;
  description.camera_model = model;
  description.intrinsics = std::move(intrinsics);
  description.width_px = description.height_px = 512;
  description.where = "a.yaml:1: cam0";
  return description;
}

TEST(CameraRegistry, MakesEveryModel) {
  const CameraRegistry registry = CameraRegistry::with_builtin_models();
  CameraDescription fisheye = describe("pinhole", {190.0, 190.0, 255.0, 257.0});
  fisheye.distortion_model = "equidistant";
  fisheye.distortion_coeffs = {0.003, 0.0007, -0.002, 0.0002};
  EXPECT_EQ(registry.make_camera(fisheye)->model(), "fisheye");
  CameraDescription omni = describe("omni", {1.2, 420.0, 420.0, 255.0, 257.0});
  EXPECT_EQ(registry.make_camera(omni)->model(), "omni");
  omni.distortion_model = "radtan";
  omni.distortion_coeffs = {-0.1, 0.02, 0.0, 0.0};
  EXPECT_EQ(registry.make_camera(omni)->model(), "omni");
  const CameraDescription eucm = describe("eucm", {0.6, 1.1, 190.0, 190.0, 255.0, 257.0});
  EXPECT_EQ(registry.make_camera(eucm)->model(), "eucm");
  const CameraDescription ds = describe("ds", {-0.2, 0.6, 160.0, 160.0, 255.0, 257.0});
  EXPECT_EQ(registry.make_camera(ds)->model(), "ds");
  CameraDescription division = describe("division", {300.0, 300.0, 255.0, 257.0});
  division.distortion_coeffs = {-0.2};
  EXPECT_EQ(registry.make_camera(division)->model(), "division");
  CameraDescription sphere = describe("equirectangular", {});
  sphere.height_px = 256;
  EXPECT_EQ(registry.make_camera(sphere)->wrap_width_px(), 512.0);
}

TEST(CameraRegistry, BadCalibrationsOfWideCamerasAreRefused) {
  CameraDescription fisheye = describe("pinhole", {190.0, 190.0, 255.0, 257.0});
  fisheye.distortion_model = "equidistant";
  fisheye.distortion_coeffs = {0.1, 0.2};
  EXPECT_EQ(error_of(fisheye),
            "a.yaml:1: cam0: distortion_coeffs has 2 numbers, expected 4 for equidistant: k1 k2 k3 "
            "k4");
  fisheye.distortion_coeffs = {-0.6, 0.0, 0.0, 0.0};
  EXPECT_EQ(error_of(fisheye),
            "a.yaml:1: cam0: distortion_coeffs fold the image back at 94 px from the principal "
            "point, 42 degrees off the axis, which leaves 90 % of the pixels without a direction, "
            "expected at most 50 %");
  fisheye.intrinsics[1] = 0.0;
  EXPECT_THAT(error_of(fisheye), HasSubstr("focal length fv is 0, expected more than 0"));
  EXPECT_THAT(error_of(describe("omni", {-0.1, 420.0, 420.0, 255.0, 257.0})),
              HasSubstr("intrinsics[0] is -0.1, expected xi of at least 0"));
  EXPECT_THAT(error_of(describe("omni", {420.0, 420.0, 255.0, 257.0})),
              HasSubstr("intrinsics has 4 numbers, expected 5: xi fu fv pu pv"));
  // So strong a mirror shrinks everything into a small circle.
  EXPECT_THAT(error_of(describe("omni", {9.0, 800.0, 800.0, 255.0, 257.0})),
              HasSubstr("xi and distortion_coeffs fold the image back at"));
  CameraDescription omni = describe("omni", {1.0, 420.0, 420.0, 255.0, 257.0});
  omni.distortion_model = "equidistant";
  EXPECT_THAT(error_of(omni), HasSubstr("is equidistant, expected radtan or none"));
  EXPECT_THAT(error_of(describe("eucm", {1.2, 1.0, 190.0, 190.0, 255.0, 257.0})),
              HasSubstr("intrinsics[0] is 1.2, expected alpha from 0 to 1"));
  EXPECT_THAT(error_of(describe("eucm", {0.5, 0.0, 190.0, 190.0, 255.0, 257.0})),
              HasSubstr("intrinsics[1] is 0, expected beta of more than 0"));
  EXPECT_THAT(error_of(describe("ds", {-1.0, 0.6, 160.0, 160.0, 255.0, 257.0})),
              HasSubstr("intrinsics[0] is -1, expected xi of more than -1 and at most 1"));
  EXPECT_THAT(error_of(describe("ds", {-0.2, 0.6, 0.0, 160.0, 255.0, 257.0})),
              HasSubstr("focal length fu is 0"));
  EXPECT_THAT(error_of(describe("division", {300.0, 300.0, 255.0, 257.0})),
              HasSubstr("distortion_coeffs has 0 numbers, expected 1 for camera_model division"));
  CameraDescription division = describe("division", {300.0, 300.0, 255.0, 257.0});
  division.distortion_coeffs = {4.0};
  EXPECT_THAT(error_of(division), HasSubstr("distortion_coeffs fold the image back at 146 px"));
  EXPECT_THAT(error_of(describe("equirectangular", {})),
              HasSubstr("resolution is [512, 512], expected twice the height as width"));
  EXPECT_THAT(error_of(describe("equirectangular", {300.0})),
              HasSubstr("intrinsics has 1 numbers, expected none for camera_model equirect"));
}

/// A camera model from outside of the library: r = f * angle, in all directions but backwards.
struct EqualAngleModel {
  static constexpr std::string_view kName = "equal_angle";
  double focal_px;
  Eigen::Vector2d center_px;

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p) const {
    const double radius = p.head<2>().norm();
    const double angle = std::atan2(radius, p.z());
    if (!(angle < 2.0)) return std::nullopt;
    if (radius == 0.0) return center_px;
    return center_px + focal_px * angle / radius * p.head<2>();
  }
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d offset = (pixel - center_px) / focal_px;
    const double angle = offset.norm();
    if (!(angle < 2.0)) return std::nullopt;
    if (angle == 0.0) return Eigen::Vector3d(0.0, 0.0, 1.0);
    const Eigen::Vector2d side = std::sin(angle) / angle * offset;
    return Eigen::Vector3d(side.x(), side.y(), std::cos(angle));
  }
  Matrix23d jacobian(const Eigen::Vector3d& p) const {
    const double radius = p.head<2>().norm();
    const double angle = std::atan2(radius, p.z());
    const Eigen::Vector2d side = p.head<2>() / radius;
    Matrix23d result;
    result.leftCols<2>() =
        focal_px * (p.z() / p.squaredNorm() * side * side.transpose() +
                    angle / radius * (Eigen::Matrix2d::Identity() - side * side.transpose()));
    result.col(2) = -focal_px * radius / p.squaredNorm() * side;
    return result;
  }
};

TEST(SameRig, IsSoByWhatItsCamerasAre) {
  CameraDescription description;
  description.camera_model = "pinhole";
  description.intrinsics = {300.0, 300.0, 160.0, 120.0};
  description.width_px = 320;
  description.height_px = 240;
  const auto rig_of = [](const CameraDescription& camera, double baseline, bool has_description) {
    Rig rig;
    for (const double x : {0.0, -baseline}) {
      rig.cameras.push_back({CameraRegistry::with_builtin_models().make_camera(camera),
                             Rigid3({1.0, 0.0, 0.0, 0.0}, {x, 0.0, 0.0})});
      if (has_description) rig.cameras.back().description = camera;
    }
    return rig;
  };
  const Rig rig = rig_of(description, 0.1, true);
  EXPECT_TRUE(is_same_rig(rig, rig_of(description, 0.1, true)));
  EXPECT_FALSE(is_same_rig(rig, rig_of(description, 0.2, true)));
  Rig mono = rig;
  mono.cameras.pop_back();
  EXPECT_FALSE(is_same_rig(rig, mono));
  const Rig unknown = rig_of(description, 0.1, false);
  EXPECT_TRUE(is_same_rig(unknown, Rig(unknown)));
  EXPECT_FALSE(is_same_rig(unknown, rig_of(description, 0.1, false)));
  description.intrinsics[0] = 301.0;
  EXPECT_FALSE(is_same_rig(rig, rig_of(description, 0.1, true)));
}

TEST(CameraRegistry, NamesOfManyLinesMakeOneLine) {
  const std::string error = error_after([](auto& d) { d.camera_model = "fish\neye"; });
  EXPECT_THAT(error, HasSubstr("camera_model is fish?eye, expected one of"));
  EXPECT_LT(error_after([](auto& d) { d.camera_model.assign(100000, 'x'); }).size(), 1100u);
}

TEST(CameraRegistry, KeepsWhatAMapHasOfUnknownModels) {
  CameraDescription description = euroc();
  description.camera_model = "mirror";
  const auto registry = CameraRegistry::with_builtin_models();
  const auto camera = registry.make_stored_camera(description);
  EXPECT_EQ(camera->model(), "mirror");
  EXPECT_EQ(camera->width_px(), 752);
  EXPECT_FALSE(camera->can_project());
  EXPECT_THAT(input_error_of([&] {
                project_for_test(*camera, {{0.0, 0.0, 1.0}});
              }),
              AllOf(StartsWith("a.yaml:1: cam0: camera_model is mirror, expected one of: division"),
                    HasSubstr("pinhole")));
  EXPECT_TRUE(registry.make_stored_camera(euroc())->can_project());
  for (const std::string& name : {std::string("fish\neye"), std::string(), std::string(101, 'x')}) {
    description.camera_model = name;
    EXPECT_THROW(registry.make_stored_camera(description), InputError) << name;
  }
  description.camera_model = "mirror";
  description.distortion_model = "a\nb";
  EXPECT_THROW(registry.make_stored_camera(description), InputError);
  description.distortion_model = "none";
  description.width_px = 0;
  EXPECT_THROW(registry.make_stored_camera(description), InputError);
}

TEST(CameraRegistry, UsersAddModels) {
  CameraRegistry registry = CameraRegistry::with_builtin_models();
  registry.add("equal_angle", [](const CameraDescription& description) {
    expect_intrinsics(description, "fu pu pv");
    expect_no_distortion(description);
    const std::vector<double>& values = description.intrinsics;
    return std::make_shared<const ModelCamera<EqualAngleModel>>(
        EqualAngleModel{values[0], {values[1], values[2]}},
        description.width_px,
        description.height_px);
  });
  CameraDescription description;
  description.camera_model = "equal_angle";
  description.intrinsics = {150.0, 320.3, 239.8};
  description.width_px = 640;
  description.height_px = 480;
  description.where = "b";
  const auto camera = registry.make_camera(description);
  EXPECT_EQ(camera->model(), "equal_angle");
  expect_camera_is_sound(*camera);
  description.distortion_model = "radtan";
  EXPECT_THROW(registry.make_camera(description), InputError);
  EXPECT_THROW(registry.add("pinhole", [](const auto&) { return nullptr; }), CheckError);
}

}  // namespace
}  // namespace waymark
