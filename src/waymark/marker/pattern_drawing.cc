// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/pattern_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "waymark/marker/marker.h"

namespace waymark {
namespace {

constexpr double kQuietModules = 1.0;
/// Around the white, in pixels: what is blurred into it.
constexpr double kMarginPx = 4.0;
constexpr double kMostPx = 96.0;

void blur_rows(const DenseImage& from, const std::vector<float>& kernel, DenseImage& to) {
  const int reach = static_cast<int>(kernel.size()) / 2;
  for (int y = 0; y < from.height; ++y) {
    for (int x = 0; x < from.width; ++x) {
      float sum = 0.0f;
      for (int k = -reach; k <= reach; ++k) {
        const int at = std::clamp(x + k, 0, from.width - 1);
        sum += kernel[static_cast<std::size_t>(k + reach)] * from.at(at, y);
      }
      to.at(y, x) = sum;  // Turned: the second time it is upright again.
    }
  }
}

std::optional<MarkerPatch> patch_around(ImageView image,
                                        const Camera& camera,
                                        const MarkerFamily& family,
                                        const Rigid3& cam_from_marker) {
  std::array<Eigen::Vector3d, 4> corners;
  std::array<Eigen::Vector2d, 4> pixels;
  std::array<std::uint8_t, 4> is_visible;
  const double side = 1.0 + 2.0 * quiet_share(family);
  for (std::size_t i = 0; i < 4; ++i) corners[i] = cam_from_marker * marker_corner(i, side);
  camera.project(corners, pixels, is_visible);
  Eigen::Vector2d low = pixels[0];
  Eigen::Vector2d high = pixels[0];
  for (std::size_t i = 0; i < 4; ++i) {
    if (!is_visible[i] || !pixels[i].allFinite()) return std::nullopt;
    low = low.cwiseMin(pixels[i]);
    high = high.cwiseMax(pixels[i]);
  }
  if ((high - low).maxCoeff() > kMostPx) return std::nullopt;
  if ((low.array() < 0.0).any() || high.x() > image.width_px - 1 || high.y() > image.height_px - 1)
    return std::nullopt;
  MarkerPatch patch;
  patch.x0 = std::max(0, static_cast<int>(std::floor(low.x() - kMarginPx)));
  patch.y0 = std::max(0, static_cast<int>(std::floor(low.y() - kMarginPx)));
  patch.width = std::min(image.width_px - 1, static_cast<int>(std::ceil(high.x() + kMarginPx))) -
                patch.x0 + 1;
  patch.height = std::min(image.height_px - 1, static_cast<int>(std::ceil(high.y() + kMarginPx))) -
                 patch.y0 + 1;
  return patch;
}

/// Notes grey values and rays.
void look_at(ImageView image, const Camera& camera, MarkerPatch& patch) {
  std::vector<Eigen::Vector2d> centres;
  patch.grey.width = patch.width;
  patch.grey.height = patch.height;
  for (int y = 0; y < patch.height; ++y) {
    for (int x = 0; x < patch.width; ++x) {
      centres.emplace_back(patch.x0 + x, patch.y0 + y);
      patch.grey.values.push_back(image.at(patch.x0 + x, patch.y0 + y));
    }
  }
  patch.tangents =
      patch.computer.compute(camera, centres, std::vector<float>(centres.size(), 1.0f));
  std::vector<Eigen::Vector2d> fine;
  for (int y = 0; y < patch.height * kPatternRays; ++y) {
    for (int x = 0; x < patch.width * kPatternRays; ++x) {
      fine.emplace_back(patch.x0 + (x + 0.5) / kPatternRays - 0.5,
                        patch.y0 + (y + 0.5) / kPatternRays - 0.5);
    }
  }
  patch.fine_bearings.resize(fine.size());
  patch.is_fine_valid.resize(fine.size());
  camera.unproject(fine, patch.fine_bearings, patch.is_fine_valid);
}

}  // namespace

void blur_image(DenseImage& image, double sigma) {
  const int reach = static_cast<int>(std::ceil(2.5 * sigma));
  std::vector<float> kernel;
  float sum = 0.0f;
  for (int k = -reach; k <= reach; ++k) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma))));
    sum += kernel.back();
  }
  for (float& weight : kernel) weight /= sum;
  DenseImage turned{image.height, image.width, std::vector<float>(image.values.size())};
  blur_rows(image, kernel, turned);
  blur_rows(turned, kernel, image);
}

PlaneMeeting meet_plane(const Rigid3& marker_from_cam, const Eigen::Vector3d& bearing) {
  const Eigen::Vector3d ahead = marker_from_cam.rotation * bearing;
  const Eigen::Vector3d& eye = marker_from_cam.translation;
  if (!(eye.z() > 0.0) || !(ahead.z() < 0.0)) return {};
  const double range = -eye.z() / ahead.z();
  return {eye.x() + range * ahead.x() + 0.5, 0.5 - eye.y() - range * ahead.y(), range, true};
}

double quiet_share(const MarkerFamily& family) { return kQuietModules / family.side_modules(); }

std::optional<MarkerPatch> look_at_marker(ImageView image,
                                          const Camera& camera,
                                          const MarkerFamily& family,
                                          const Rigid3& cam_from_marker) {
  std::optional<MarkerPatch> patch = patch_around(image, camera, family, cam_from_marker);
  if (patch) look_at(image, camera, *patch);
  return patch;
}

PatternDrawing draw_pattern(const MarkerPatch& patch,
                            const std::vector<std::uint8_t>& modules,
                            const MarkerFamily& family,
                            const Rigid3& cam_from_marker,
                            double blur_px) {
  const Rigid3 marker_from_cam = cam_from_marker.inverse();
  const double quiet = quiet_share(family);
  const int count = family.side_modules();
  const std::vector<float> zeros(patch.fine_bearings.size(), 0.0f);
  const int width = patch.width * kPatternRays;
  const int height = patch.height * kPatternRays;
  PatternDrawing drawing{{width, height, zeros}, {width, height, zeros}};
  for (std::size_t i = 0; i < zeros.size(); ++i) {
    const PlaneMeeting at = meet_plane(marker_from_cam, patch.fine_bearings[i]);
    const bool is_on_paper = patch.is_fine_valid[i] && at.is_ahead && at.u > -quiet &&
                             at.v > -quiet && at.u < 1.0 + quiet && at.v < 1.0 + quiet;
    if (!is_on_paper) {
      drawing.outside.values[i] = 1.0f;
    } else if (at.u > 0.0 && at.v > 0.0 && at.u < 1.0 && at.v < 1.0) {
      const int module = static_cast<int>(at.v * count) * count + static_cast<int>(at.u * count);
      drawing.black.values[i] = modules[static_cast<std::size_t>(module)] ? 0.0f : 1.0f;
    }
  }
  // The area of a pixel is a part of the blur.
  const double sigma = kPatternRays * std::sqrt(blur_px * blur_px + 1.0 / 12.0);
  blur_image(drawing.black, sigma);
  blur_image(drawing.outside, sigma);
  return drawing;
}

DrawnSample sample_at(const DenseImage& image, int x, int y) {
  const int left = x * kPatternRays;
  const int top = y * kPatternRays;
  double sum = 0.0;
  Eigen::RowVector2d slope = Eigen::RowVector2d::Zero();
  for (int k = 1; k <= 2; ++k) {
    sum += image.at(left + 1, top + k) + image.at(left + 2, top + k);
    slope.x() += image.at(left + 3, top + k) - image.at(left, top + k);
    slope.y() += image.at(left + k, top + 3) - image.at(left + k, top);
  }
  return {0.25 * sum, slope * (0.5 * kPatternRays / 3.0)};
}

}  // namespace waymark
