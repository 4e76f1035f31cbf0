// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/rotation_alignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "waymark/base/thread_pool.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/camera/registry.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

constexpr int kHeightPx = 160;
constexpr double kSmallSizePx = 80.0;

std::shared_ptr<const Camera> make_camera(const std::string& name) {
  return CameraRegistry::with_builtin_models().make_camera(named_camera(name, kHeightPx));
}

/// A camera in a furnished room.
class Room {
 public:
  explicit Room(std::shared_ptr<const Camera> camera)
      : camera_(camera), renderer_(make_world("room", 3), camera) {}

  Image look(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& moved_m = {0, 0, 0}) {
    const Rigid3 turned(so3_exp(turn_rad), moved_m);
    return renderer_.image(pose_of({{1.5, 1.3, 1.5}, 35.0, -6.0, 0.0}) * turned, pool_);
  }

  /// Of a pixel of a small image.
  double small_pixel_rad() const {
    const double size_px = std::max(camera_->width_px(), camera_->height_px());
    return central_pixel_angle(*camera_) * size_px / kSmallSizePx;
  }

 private:
  std::shared_ptr<const Camera> camera_;
  Renderer renderer_;
  ThreadPool pool_{1};
};

double error_rad(const RotationAlignment& alignment, const Eigen::Vector3d& turn_rad) {
  return alignment.b_from_a.angularDistance(so3_exp(-turn_rad));
}

TEST(RotationAligner, FindsTheTurnWithEveryCamera) {
  for (const std::string& name : camera_names()) {
    SCOPED_TRACE(name);
    const auto camera = make_camera(name);
    Room room(camera);
    RotationAligner aligner;
    const SmallImage a = make_small_image(room.look({0, 0, 0}).view(), {});
    for (const Eigen::Vector3d& turn_rad : {Eigen::Vector3d(0.02, -0.05, 0.01),
                                            Eigen::Vector3d(-0.1, 0.4, 0.05),
                                            Eigen::Vector3d(0.25, -0.3, -0.08)}) {
      const RotationAlignment found =
          aligner.align(camera, a, make_small_image(room.look(turn_rad).view(), {}));
      EXPECT_LT(error_rad(found, turn_rad), 0.2 * room.small_pixel_rad());
      EXPECT_GT(found.correlation, name == "fisheye_200" ? 0.6 : 0.9);  // A black border.
    }
  }
}

TEST(RotationAligner, IsNotMisledByExposureNorByAStep) {
  const auto camera = make_camera("perspective");
  Room room(camera);
  const Eigen::Vector3d turn_rad(0.05, 0.3, 0.0);
  const Image before = room.look({0, 0, 0});
  Image after = room.look(turn_rad, {0.05, 0.0, 0.05});
  for (std::uint8_t& grey : after.values) grey = static_cast<std::uint8_t>(20 + grey / 2);
  const RotationAlignment found = RotationAligner().align(
      camera, make_small_image(before.view(), {}), make_small_image(after.view(), {}));
  EXPECT_LT(error_rad(found, turn_rad), 2.0 * room.small_pixel_rad());
  EXPECT_NEAR(found.gain, 0.5, 0.1);
}

TEST(RotationAligner, LooksOnlyWhereTheMaskLetsIt) {
  const auto camera = make_camera("perspective");
  Room room(camera);
  const Eigen::Vector3d turn_rad(0.0, 0.25, 0.0);
  Image mask(camera->width_px(), camera->height_px());
  std::fill(mask.values.begin(), mask.values.end(), std::uint8_t{8});
  Image before = room.look({0, 0, 0}), after = room.look(turn_rad);
  for (int y = kHeightPx / 2; y < kHeightPx; ++y) {  // What moves along.
    for (int x = 0; x < mask.width_px; ++x) {
      mask.row(y)[x] = 0;
      before.row(y)[x] = after.row(y)[x] = (x / 20 + y / 20) % 2 == 0 ? 250 : 5;
    }
  }
  RotationAligner aligner;
  const auto error_with = [&](ImageView used) {
    return error_rad(
        aligner.align(
            camera, make_small_image(before.view(), used), make_small_image(after.view(), used)),
        turn_rad);
  };
  EXPECT_LT(error_with(mask.view()), 0.3 * room.small_pixel_rad());
  EXPECT_GT(error_with({}), 0.1);
}

TEST(RotationAligner, HasNothingToSayOfImagesWithoutContent) {
  const auto camera = make_camera("perspective");
  const SmallImage black =
      make_small_image(Image(camera->width_px(), camera->height_px()).view(), {});
  const SmallImage seen = make_small_image(Room(camera).look({0, 0, 0}).view(), {});
  RotationAligner aligner;
  EXPECT_EQ(aligner.align(camera, black, seen).correlation, 0.0);
  EXPECT_EQ(aligner.align(camera, seen, black).correlation, 0.0);
  Image mask(camera->width_px(), camera->height_px());  // All of it.
  const SmallImage masked = make_small_image(Room(camera).look({0, 0, 0}).view(), mask.view());
  EXPECT_EQ(aligner.align(camera, masked, seen).correlation, 0.0);
}

TEST(RotationAligner, HasNothingToSayOfStrips) {
  CameraDescription description = named_camera("perspective", kHeightPx);
  description.width_px = 3000;
  description.height_px = 36;
  const auto camera = CameraRegistry::with_builtin_models().make_camera(description);
  const SmallImage strip = make_small_image(Image(3000, 36).view(), {});
  EXPECT_EQ(RotationAligner().align(camera, strip, strip).correlation, 0.0);
}

TEST(RotationAligner, HasTheDerivativeByATurn) {
  const auto grey = [](const Eigen::Vector2d& pixel) {
    return 100.0 * std::sin(0.05 * pixel.x()) * std::cos(0.04 * pixel.y());
  };
  const auto slope = [](const Eigen::Vector2d& pixel) {
    const double x = 0.05 * pixel.x(), y = 0.04 * pixel.y();
    return Eigen::Vector2d(5.0 * std::cos(x) * std::cos(y), -4.0 * std::sin(x) * std::sin(y));
  };
  for (const std::string& name : camera_names()) {
    SCOPED_TRACE(name);
    const auto camera = make_camera(name);
    const Eigen::Vector3d bearing = Eigen::Vector3d(0.2, -0.3, 1.0).normalized();
    Eigen::Vector2d pixel;
    Matrix23d pixel_from_bearing;
    std::uint8_t is_visible = 0;
    const auto project = [&](const Eigen::Vector3d& at) {
      camera->project_with_jacobian(
          {&at, 1}, {&pixel, 1}, {&pixel_from_bearing, 1}, {&is_visible, 1});
      EXPECT_TRUE(is_visible);
    };
    project(bearing);
    const Eigen::Vector3d gradient = gradient_by_turn(bearing, pixel_from_bearing, slope(pixel));
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kStep = 1e-6;
      const Eigen::Vector3d turn = kStep * Eigen::Vector3d::Unit(axis);
      project(so3_exp(turn) * bearing);
      const double after = grey(pixel);
      project(so3_exp(-turn) * bearing);
      EXPECT_NEAR((after - grey(pixel)) / (2.0 * kStep), gradient[axis], 1e-3 * gradient.norm());
    }
  }
}

}  // namespace
}  // namespace waymark
