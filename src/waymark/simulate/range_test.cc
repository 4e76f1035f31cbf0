// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Stereo search on rendered pairs of wide cameras, parallel and verged, and their depth images,
// against the true distances.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "waymark/camera/registry.h"
#include "waymark/features/frame_builder.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

struct StereoCase {
  const char* name;
  CameraDescription camera;
  double verged_rad;
};

void PrintTo(const StereoCase& stereo, std::ostream* stream) { *stream << stereo.name; }

CameraDescription describe(const char* model, std::vector<double> intrinsics, int width_px = 480) {
  CameraDescription description;
  description.camera_model = model;
  description.intrinsics = std::move(intrinsics);
  description.width_px = width_px;
  description.height_px = 480;
  description.where = model;
  return description;
}

CameraDescription fisheye(double focal_px) {
  CameraDescription description = describe("pinhole", {focal_px, focal_px, 239.3, 240.8});
  description.distortion_model = "equidistant";
  description.distortion_coeffs = {0.003, 0.0007, -0.002, 0.0002};
  return description;
}

class StereoRange : public ::testing::TestWithParam<StereoCase> {};

TEST_P(StereoRange, IsThatOfTheWorld) {
  const StereoCase& stereo = GetParam();
  constexpr double kBaselineM = 0.11;
  const auto camera = CameraRegistry::with_builtin_models().make_camera(stereo.camera);
  Vector6d motion;
  motion << -kBaselineM, 0.0, 0.0, 0.0, stereo.verged_rad, 0.0;
  const Rig rig{{{camera, Rigid3()}, {camera, Rigid3::exp(motion)}}};
  const auto world = make_world("room", 3);
  const Renderer renderer(world, camera);
  ThreadPool pool(2);
  FrameBuilder builder(rig, {.features = {.count = 1000}});
  std::size_t num_primary = 0;
  std::vector<double> errors_px;
  for (const double time_s : {1.0, 4.3, 7.7}) {
    const Rigid3 world_from_rig = make_motion("room", "loop", 10.0).world_from_rig(time_s);
    const Image left = renderer.image(world_from_rig, pool);
    const Image right =
        renderer.image(world_from_rig * rig.cameras[1].cam_from_rig.inverse(), pool);
    const auto features = builder.build({.image0 = left.view(), .image1 = right.view()});
    num_primary += features->num_primary;
    for (std::size_t i = 0; i < features->num_primary; ++i) {
      if (features->partner[i] == kNoFeature || !(features->range_m[i] > 0.0f)) continue;
      const Eigen::Vector3d bearing = features->bearings[i].cast<double>();
      const auto hit =
          world->intersect(world_from_rig.translation, world_from_rig.rotation * bearing);
      if (!hit) continue;
      const double across_m = kBaselineM * std::hypot(bearing.y(), bearing.z());
      const double error = 1.0 / features->range_m[i] - 1.0 / hit->hit.distance;
      errors_px.push_back(std::abs(error) * across_m / features->size_rad[features->partner[i]]);
    }
  }
  std::sort(errors_px.begin(), errors_px.end());
  const auto quantile = [&](double q) {
    return errors_px[static_cast<std::size_t>(q * static_cast<double>(errors_px.size()))];
  };
  EXPECT_GT(errors_px.size(), num_primary * 8 / 10);
  EXPECT_LT(quantile(0.5), 0.1);
  EXPECT_LT(quantile(0.95), 0.4);
}

class MeasuredRange : public ::testing::TestWithParam<std::string> {};

TEST_P(MeasuredRange, ErrsByItsSigma) {
  constexpr double kUnits = 5000.0;
  const auto camera =
      CameraRegistry::with_builtin_models().make_camera(named_camera(GetParam(), 480));
  const auto world = make_world("room", 3);
  const Renderer renderer(world, camera);
  ThreadPool pool(2);
  FrameBuilder builder({{{camera, Rigid3()}}},
                       {.features = {.count = 1000}, .depth = {.factor = kUnits}});
  ImageEffects effects;
  effects.inverse_depth_sigma = 0.0014;
  std::vector<double> errors;
  for (const double time_s : {1.0, 4.3, 7.7}) {
    const Rigid3 world_from_cam = make_motion("room", "loop", 10.0).world_from_rig(time_s);
    const Image image = renderer.image(world_from_cam, pool);
    DepthImage depth = renderer.depth(world_from_cam, kUnits, pool);
    Rng rng(1, 1);
    apply_depth_noise(effects, kUnits, rng, depth);
    const auto features = builder.build({.image0 = image.view(), .depth = depth.view()});
    for (std::size_t i = 0; i < features->num_primary; ++i) {
      if (!(features->range_m[i] > 0.0f)) continue;
      const Eigen::Vector3d bearing = features->bearings[i].cast<double>();
      const auto hit =
          world->intersect(world_from_cam.translation, world_from_cam.rotation * bearing);
      if (!hit) continue;
      const double error = 1.0 / features->range_m[i] - 1.0 / hit->hit.distance;
      errors.push_back(std::abs(error) / features->inverse_range_sigma[i]);
    }
  }
  std::sort(errors.begin(), errors.end());
  const auto quantile = [&](double q) {
    return errors[static_cast<std::size_t>(q * static_cast<double>(errors.size()))];
  };
  // Averaged over a few pixels, hence better than stated.
  EXPECT_GT(errors.size(), 2500u);
  EXPECT_LT(quantile(0.68), 1.0);
  EXPECT_LT(quantile(0.95), 2.0);
}

INSTANTIATE_TEST_SUITE_P(Cameras,
                         MeasuredRange,
                         ::testing::Values("perspective", "fisheye", "fisheye_200"));

INSTANTIATE_TEST_SUITE_P(
    Cameras,
    StereoRange,
    ::testing::Values(
        StereoCase{"perspective", describe("pinhole", {300.0, 300.0, 239.3, 240.8}), 0.0},
        StereoCase{"fisheye", fisheye(170.0), 0.0},
        StereoCase{"fisheye_verged", fisheye(170.0), 0.17},
        StereoCase{"fisheye_200", fisheye(130.0), 0.0},
        StereoCase{"ds", describe("ds", {-0.2, 0.6, 150.0, 150.0, 239.3, 240.8}), 0.0},
        StereoCase{"equirectangular", describe("equirectangular", {}, 960), 0.0}),
    [](const ::testing::TestParamInfo<StereoCase>& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace waymark
