// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/patch_alignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "waymark/base/rng.h"
#include "waymark/base/thread_pool.h"
#include "waymark/camera/registry.h"
#include "waymark/image/convert.h"
#include "waymark/image/small_image.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

constexpr int kSizePx = 480;

/// Each pixel the mean over so many to its right, as a camera that turns smears them.
Image blurred_along(const Image& image, int num_px) {
  Image result = image;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      int sum = 0;
      for (int i = 0; i < num_px; ++i) {
        sum += image.row(y)[std::clamp(x + i - num_px / 2, 0, image.width_px - 1)];
      }
      result.row(y)[x] = static_cast<std::uint8_t>(sum / num_px);
    }
  }
  return result;
}

/// A camera that stands in a furnished room, and knows how far away some points are.
class PatchAlignmentTest : public ::testing::TestWithParam<std::string> {
 protected:
  PatchAlignmentTest()
      : camera_(
            CameraRegistry::with_builtin_models().make_camera(named_camera(GetParam(), kSizePx))),
        renderer_(make_world("room", 3), camera_) {}

  Image look(const Rigid3& world_from_cam) {
    const Image image = renderer_.image(world_from_cam, pool_);
    return reduce(image.view(), detail_factor(image.width_px, image.height_px));
  }

  std::vector<Eigen::Vector3d> points(const Rigid3& world_from_cam) {
    constexpr double kUnitsPerMetre = 5000.0;
    const DepthImage depth = renderer_.depth(world_from_cam, kUnitsPerMetre, pool_);
    std::vector<Eigen::Vector3d> result;
    for (int y = 20; y < camera_->height_px(); y += 20) {
      for (int x = 20; x < camera_->width_px(); x += 20) {
        const Eigen::Vector2d pixel(x, y);
        Eigen::Vector3d bearing;
        std::uint8_t is_valid = 0;
        camera_->unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
        if (!is_valid || depth.row(y)[x] == 0) continue;
        result.push_back(depth.row(y)[x] / kUnitsPerMetre / bearing.z() * bearing);
      }
    }
    return result;
  }

  const Rigid3 here_ = pose_of({{1.5, 1.3, 1.5}, 35.0, -6.0, 0.0});
  ThreadPool pool_{1};
  std::shared_ptr<const Camera> camera_;
  Renderer renderer_;
  PatchAligner aligner_;
};

TEST_P(PatchAlignmentTest, FindsTheMotionInBlurredAndDarkerImages) {
  const Rigid3 motion(so3_exp({0.01, 0.03, -0.01}), {0.04, -0.02, 0.05});
  const Image before = look(here_);
  Image after = look(here_ * motion);
  for (std::uint8_t& grey : after.values) grey = static_cast<std::uint8_t>(10 + grey / 2);
  after = blurred_along(after, 5);
  const PatchAlignment found = aligner_.align(camera_, before, points(here_), after, {});
  EXPECT_TRUE(found.is_certain()) << found.correlation << " " << found.pixel_sigma;
  const Rigid3 error = found.b_from_a * motion;
  EXPECT_LT(error.translation.norm(), 0.01);
  EXPECT_LT(so3_log(error.rotation).norm(), 0.005);
}

TEST_P(PatchAlignmentTest, IsNotCertainOfAnotherPlace) {
  const Rigid3 elsewhere = pose_of({{2.5, 2.0, 1.5}, 190.0, -6.0, 0.0});
  EXPECT_FALSE(
      aligner_.align(camera_, look(here_), points(here_), look(elsewhere), {}).is_certain());
}

TEST_P(PatchAlignmentTest, IsNotCertainWhereThereIsNothingToSee) {
  Image before = look(here_), after = before;
  Rng rng(7, 0);
  for (Image* blank : {&before, &after}) {
    for (std::uint8_t& grey : blank->values) grey = static_cast<std::uint8_t>(80 + rng.below(5));
  }
  EXPECT_FALSE(aligner_.align(camera_, before, points(here_), after, {}).is_certain());
  EXPECT_FALSE(aligner_.align(camera_, look(here_), {}, look(here_), {}).is_certain());
}

INSTANTIATE_TEST_SUITE_P(
    Cameras,
    PatchAlignmentTest,
    ::testing::Values("perspective", "fisheye", "fisheye_200", "equirectangular"));

}  // namespace
}  // namespace waymark
