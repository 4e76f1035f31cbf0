// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/render.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/perspective.h"
#include "waymark/simulate/motion.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kUnits = 5000.0;

std::shared_ptr<const Camera> make_camera(int width, int height, double focal) {
  const std::array<double, 4> distortion = {-0.2, 0.05, 0.0003, -0.0002};
  return std::make_shared<PerspectiveCamera>(
      PerspectiveModel({focal, focal}, {0.5 * width, 0.5 * height}, distortion), width, height);
}

Vector3d bearing_of(const Camera& camera, const Vector2d& pixel) {
  Vector3d bearing;
  std::uint8_t is_valid = 0;
  camera.unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
  EXPECT_TRUE(is_valid);
  return bearing;
}

std::optional<Vector2d> pixel_of(const Camera& camera, const Vector3d& point_in_cam) {
  Vector2d pixel;
  std::uint8_t is_visible = 0;
  camera.project({&point_in_cam, 1}, {&pixel, 1}, {&is_visible, 1});
  return is_visible ? std::optional(pixel) : std::nullopt;
}

TEST(Renderer, DepthIsThatOfTheIntersection) {
  ThreadPool pool(1);
  for (const char* name : {"room", "street"}) {
    const auto world = make_world(name, 3);
    const auto camera = make_camera(200, 150, 110.0);
    const Rigid3 pose = make_motion(name, "loop", 10.0).world_from_rig(4.3);
    const DepthImage depth = Renderer(world, camera).depth(pose, 500.0, pool);
    int num_hits = 0;
    for (int y = 0; y < 150; y += 3) {
      for (int x = 0; x < 200; x += 3) {
        const Vector3d bearing = bearing_of(*camera, Vector2d(x, y));
        const auto hit = world->intersect(pose.translation, pose.rotation * bearing);
        const double expected = hit ? 500.0 * hit->hit.distance * bearing.z() : 0.0;
        ASSERT_NEAR(depth.row(y)[x], expected, 0.51) << name << " " << x << " " << y;
        num_hits += hit ? 1 : 0;
      }
    }
    EXPECT_GT(num_hits, 2000);
  }
}

TEST(Renderer, PixelsAreTheMeanOverTheirSquare) {
  const auto world = make_world("hall", 3);
  const auto camera = make_camera(320, 240, 200.0);
  const Rigid3 pose = make_motion("hall", "loop", 10.0).world_from_rig(2.0);
  ThreadPool pool(1);
  const Image image = Renderer(world, camera).image(pose, pool);
  double sum = 0.0;
  double sum_squares = 0.0;
  int count = 0;
  for (int y = 5; y < 240; y += 12) {
    for (int x = 5; x < 320; x += 12) {
      constexpr int kRays = 10;
      double mean = 0.0;
      for (int k = 0; k < kRays * kRays; ++k) {
        const Vector2d offset((k % kRays + 0.5) / kRays - 0.5, (k / kRays + 0.5) / kRays - 0.5);
        const Vector3d ray = pose.rotation * bearing_of(*camera, Vector2d(x, y) + offset);
        const auto hit = world->intersect(pose.translation, ray);
        ASSERT_TRUE(hit.has_value());
        const Texture& texture = world->textures[world->surfaces[hit->surface].texture];
        const double light =
            0.82 + 0.18 * hit->hit.normal.dot(Vector3d(0.35, -0.5, 0.8).normalized());
        mean += light * texture.sample(hit->hit.uv.cast<float>(), {0.001f, 0.0f}, {0.0f, 0.001f});
      }
      const double error = image.row(y)[x] - mean / (kRays * kRays);
      sum += error;
      sum_squares += error * error;
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, 0.0, 0.6);
  EXPECT_LT(std::sqrt(sum_squares / count), 7.0);
}

/// Two views of a world and how a patch of the first lands in the second.
class TwoViews {
 public:
  TwoViews(const std::string& name, double seconds0, double seconds1)
      : world_(make_world(name, 4)), camera_(make_camera(320, 240, 200.0)) {
    const Motion motion = make_motion(name, "loop", 20.0);
    ThreadPool pool(1);
    const Renderer renderer(world_, camera_);
    const std::array<double, 2> seconds = {seconds0, seconds1};
    for (std::size_t i = 0; i < 2; ++i) {
      poses_[i] = motion.world_from_rig(seconds[i]);
      images_[i] = renderer.image(poses_[i], pool);
    }
  }

  /// Where what is at a pixel of image 0 is in image 1; nothing if hidden or outside.
  std::optional<Vector2d> warp(const Vector2d& pixel) const {
    const Vector3d ray = poses_[0].rotation * bearing_of(*camera_, pixel);
    const auto hit = world_->intersect(poses_[0].translation, ray);
    if (!hit) return std::nullopt;
    const Vector3d point = poses_[0].translation + hit->hit.distance * ray;
    const auto back = world_->intersect(poses_[1].translation, point - poses_[1].translation);
    if (!back || back->surface != hit->surface || back->hit.distance < 0.999) return std::nullopt;
    return pixel_of(*camera_, poses_[1].inverse() * point);
  }

  double grey(std::size_t image, const Vector2d& pixel) const {
    const int x = static_cast<int>(std::floor(pixel.x()));
    const int y = static_cast<int>(std::floor(pixel.y()));
    const double right = pixel.x() - x;
    const double down = pixel.y() - y;
    const std::uint8_t* top = images_[image].row(y) + x;
    const std::uint8_t* bottom = images_[image].row(y + 1) + x;
    return (1.0 - down) * ((1.0 - right) * top[0] + right * top[1]) +
           down * ((1.0 - right) * bottom[0] + right * bottom[1]);
  }

  /// Least-squares shift of the patch in image 1 (Lucas & Kanade 1981); nothing if part of it is
  /// not seen or it has no corner.
  std::optional<Vector2d> shift(const Vector2d& centre) const {
    constexpr int kHalf = 4;
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Vector2d vector = Vector2d::Zero();
    for (int dy = -kHalf; dy <= kHalf; ++dy) {
      for (int dx = -kHalf; dx <= kHalf; ++dx) {
        const Vector2d pixel = centre + Vector2d(dx, dy);
        const std::optional<Vector2d> there = warp(pixel);
        if (!there || (there->array() < 3.0).any() || there->x() > 315.0 || there->y() > 235.0) {
          return std::nullopt;
        }
        const Vector2d gradient(
            0.5 * (grey(1, *there + Vector2d::UnitX()) - grey(1, *there - Vector2d::UnitX())),
            0.5 * (grey(1, *there + Vector2d::UnitY()) - grey(1, *there - Vector2d::UnitY())));
        information += gradient * gradient.transpose();
        vector += gradient * (grey(0, pixel) - grey(1, *there));
      }
    }
    const double trace = information.trace();
    const double smaller =
        0.5 * (trace - std::sqrt(trace * trace - 4.0 * information.determinant()));
    if (smaller < 3000.0) return std::nullopt;
    return Vector2d(information.inverse() * vector);
  }

 private:
  std::shared_ptr<const World> world_;
  std::shared_ptr<const Camera> camera_;
  std::array<Rigid3, 2> poses_;
  std::array<Image, 2> images_;
};

TEST(Renderer, TexturesStayWhereTheyAreBetweenViews) {
  for (const char* name : {"room", "apartment", "street"}) {
    const TwoViews views(name, 6.0, 6.3);
    Vector2d mean = Vector2d::Zero();
    std::vector<double> lengths;
    for (int y = 12; y < 230; y += 9) {
      for (int x = 12; x < 310; x += 9) {
        const std::optional<Vector2d> shift = views.shift(Vector2d(x, y));
        if (!shift) continue;
        lengths.push_back(shift->norm());
        mean += *shift;
      }
    }
    ASSERT_GT(lengths.size(), 100u) << name;
    mean /= static_cast<double>(lengths.size());
    std::sort(lengths.begin(), lengths.end());
    EXPECT_LT(mean.norm(), 0.03) << name;
    EXPECT_LT(lengths[lengths.size() / 2], 0.08) << name;
    EXPECT_LT(lengths[lengths.size() * 9 / 10], 0.3) << name;
  }
}

TEST(Renderer, SameForAnyNumberOfThreads) {
  const auto world = make_world("street", 5);
  const auto camera = make_camera(203, 149, 120.0);
  const Rigid3 pose = make_motion("street", "loop", 10.0).world_from_rig(1.0);
  const Renderer renderer(world, camera);
  ThreadPool one(1);
  ThreadPool three(3);
  const Image image = renderer.image(pose, one);
  EXPECT_EQ(image.values, renderer.image(pose, three).values);
  EXPECT_EQ(image.values, renderer.image(pose, one).values);
  EXPECT_EQ(renderer.depth(pose, kUnits, one).values, renderer.depth(pose, kUnits, three).values);
}

TEST(Renderer, ViewsAreRichInCorners) {
  ThreadPool pool(2);
  const auto camera = make_camera(640, 480, 420.0);
  const auto orb = cv::ORB::create(20000, 1.2f, 8, 19, 0, 2, cv::ORB::HARRIS_SCORE, 31, 12);
  for (const char* name : {"room", "apartment", "hall", "street"}) {
    const Renderer renderer(make_world(name, 6), camera);
    const Motion motion = make_motion(name, "loop", 20.0);
    for (const double seconds : {0.0, 5.0, 11.0}) {
      const Image image = renderer.image(motion.world_from_rig(seconds), pool);
      const cv::Mat mat(480, 640, CV_8UC1, const_cast<std::uint8_t*>(image.values.data()));
      std::vector<cv::KeyPoint> keypoints;
      orb->detect(mat, keypoints);
      std::set<int> cells;
      for (const cv::KeyPoint& keypoint : keypoints) {
        cells.insert(static_cast<int>(keypoint.pt.x / 64) * 10 +
                     static_cast<int>(keypoint.pt.y / 48));
      }
      EXPECT_GT(keypoints.size(), 1500u) << name << " " << seconds;
      // The sky over a street has no corners.
      EXPECT_GT(cells.size(), std::string(name) == "street" ? 60u : 85u) << name << " " << seconds;
    }
  }
}

}  // namespace
}  // namespace waymark
