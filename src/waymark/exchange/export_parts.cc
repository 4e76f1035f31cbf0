// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/pixel_angles.h"

namespace waymark {
namespace {

constexpr double kOffAxisRad = 55.0 * std::numbers::pi / 180.0;
constexpr int kMinSizePx = 64;
constexpr int kMaxPartSizePx = 4096;
constexpr double kMaxTan = std::numbers::sqrt3;  // 60 degrees.

Eigen::Quaterniond turn(double angle_rad, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

/// How the parts stand in the camera.
std::vector<Eigen::Quaterniond> parts_from_camera(bool is_whole_sphere, int num_views) {
  constexpr double kPi = std::numbers::pi;
  const bool is_cube = is_whole_sphere && num_views == 6;
  const int num_ring = is_cube ? 4 : is_whole_sphere ? num_views : num_views - 1;
  std::vector<Eigen::Quaterniond> camera_from_part;
  if (!is_whole_sphere) camera_from_part.push_back(Eigen::Quaterniond::Identity());
  for (int i = 0; i < num_ring; ++i) {
    const double angle = 2.0 * kPi * i / num_ring;
    camera_from_part.push_back(is_whole_sphere
                                   ? turn(angle, Eigen::Vector3d::UnitY())
                                   : turn(kOffAxisRad, {-std::sin(angle), std::cos(angle), 0.0}));
  }
  if (is_cube) {
    camera_from_part.push_back(turn(0.5 * kPi, Eigen::Vector3d::UnitX()));
    camera_from_part.push_back(turn(-0.5 * kPi, Eigen::Vector3d::UnitX()));
  }
  for (Eigen::Quaterniond& rotation : camera_from_part) rotation = rotation.conjugate();
  return camera_from_part;
}

void find_hidden(SplitPart& part) {
  const std::vector<std::uint8_t> is_visible = make_lookup(part).is_visible;
  part.sees_all = std::find(is_visible.begin(), is_visible.end(), 0) == is_visible.end();
}

/// An upright rectangle on the plane at distance 1 in front of a camera.
using PlaneBox = Eigen::AlignedBox2d;

/// What the rims of the image leave of the plane, up to kMaxTan. Of a rim what has no direction, or
/// one behind the camera, leaves all.
PlaneBox box_between_rims(const Camera& camera) {
  PlaneBox box(Eigen::Vector2d::Constant(-kMaxTan), Eigen::Vector2d::Constant(kMaxTan));
  const Eigen::Vector2d last(camera.width_px() - 1, camera.height_px() - 1);
  for (int along = 0; along < 2; ++along) {  // Rims along x bound y, and the other way round.
    const int across = 1 - along;
    std::vector<Eigen::Vector2d> pixels;
    for (int i = 0; i <= last[along]; ++i) {
      for (const double rim : {0.0, last[across]}) {
        pixels.emplace_back();
        pixels.back()[along] = i;
        pixels.back()[across] = rim;
      }
    }
    std::vector<Eigen::Vector3d> bearings(pixels.size());
    std::vector<std::uint8_t> has_bearing(pixels.size());
    camera.unproject(pixels, bearings, has_bearing);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!has_bearing[i] || !(bearings[i].z() > 0.0)) continue;
      const double at = bearings[i][across] / bearings[i].z();
      double& lower = box.min()[across];
      double& upper = box.max()[across];
      if (i % 2 == 0) lower = std::max(lower, at);
      if (i % 2 == 1) upper = std::min(upper, at);
    }
  }
  return box;
}

/// Pixels of the middle of an image per unit of the plane at distance 1; nothing where the camera
/// does not see that.
std::optional<Eigen::Vector2d> central_focal_px(const Camera& camera) {
  constexpr double kStep = 1e-5;
  const std::array<Eigen::Vector3d, 4> around = {Eigen::Vector3d(-kStep, 0.0, 1.0),
                                                 Eigen::Vector3d(kStep, 0.0, 1.0),
                                                 Eigen::Vector3d(0.0, -kStep, 1.0),
                                                 Eigen::Vector3d(0.0, kStep, 1.0)};
  std::array<Eigen::Vector2d, 4> pixels;
  std::array<std::uint8_t, 4> is_visible;
  camera.project(around, pixels, is_visible);
  if (std::ranges::count(is_visible, 0) > 0) return std::nullopt;
  return Eigen::Vector2d(pixels[1].x() - pixels[0].x(), pixels[3].y() - pixels[2].y()) /
         (2.0 * kStep);
}

}  // namespace

std::vector<SplitPart> split_parts(std::shared_ptr<const Camera> camera, int num_views) {
  const int size_px = std::clamp(static_cast<int>(std::lround(2.0 / central_pixel_angle(*camera))),
                                 kMinSizePx,
                                 kMaxPartSizePx);
  const double focal_px = 0.5 * size_px;  // 45 degrees from the centre to the rim.
  const double center_px = 0.5 * (size_px - 1);
  const PerspectiveModel pinhole({focal_px, focal_px}, {center_px, center_px});
  std::vector<SplitPart> parts;
  for (const Eigen::Quaterniond& rotation :
       parts_from_camera(camera->wrap_width_px() > 0.0, num_views)) {
    parts.push_back({camera, rotation, pinhole, size_px, size_px});
    find_hidden(parts.back());
  }
  return parts;
}

SplitPart undistorted_part(std::shared_ptr<const Camera> camera) {
  constexpr double kMaxGrowth = 2.0;
  const std::optional<Eigen::Vector2d> central_px = central_focal_px(*camera);
  const PlaneBox box = box_between_rims(*camera);
  if (camera->wrap_width_px() > 0.0 || !central_px || !(central_px->minCoeff() > 0.0) ||
      box.isEmpty()) {
    throw InputError("export",
                     "--undistort needs a camera with one view ahead, expected none of 360 degrees "
                     "(see --split-views)");
  }
  Eigen::Vector2d focal_px = *central_px;
  const Eigen::Vector2d most_px =
      kMaxGrowth * Eigen::Vector2d(camera->width_px(), camera->height_px());
  focal_px *=
      std::min(1.0, (most_px.array() / (box.sizes().array() * focal_px.array())).minCoeff());
  const Eigen::Vector2d center_px = -(box.min().array() * focal_px.array());
  const Eigen::Vector2d last_px = box.sizes().array() * focal_px.array();
  SplitPart part{std::move(camera),
                 Eigen::Quaterniond::Identity(),
                 PerspectiveModel(focal_px, center_px),
                 static_cast<int>(last_px.x()) + 1,
                 static_cast<int>(last_px.y()) + 1,
                 /*is_only_one=*/true};
  find_hidden(part);
  return part;
}

SplitLookup make_lookup(const SplitPart& part) {
  const Eigen::Quaterniond camera_from_part = part.part_from_camera.conjugate();
  const auto width = static_cast<std::size_t>(part.width_px);
  const std::size_t num_pixels = width * static_cast<std::size_t>(part.height_px);
  SplitLookup lookup{std::vector<Eigen::Vector2d>(num_pixels),
                     std::vector<std::uint8_t>(num_pixels)};
  std::vector<Eigen::Vector3d> bearings(width);
  for (std::size_t row = 0; row < num_pixels; row += width) {
    const auto y = static_cast<double>(row / width);
    for (std::size_t x = 0; x < width; ++x) {
      bearings[x] = camera_from_part * *part.pinhole.unproject({static_cast<double>(x), y});
    }
    part.camera->project(bearings, {&lookup.pixels[row], width}, {&lookup.is_visible[row], width});
  }
  return lookup;
}

Image split_mask(const SplitPart& part) { return split_mask(part, make_lookup(part)); }

Image split_mask(const SplitPart& part, const SplitLookup& lookup) {
  Image mask(part.width_px, part.height_px);
  for (std::size_t i = 0; i < lookup.is_visible.size(); ++i) {
    mask.values[i] = lookup.is_visible[i] ? 255 : 0;
  }
  return mask;
}

}  // namespace waymark
