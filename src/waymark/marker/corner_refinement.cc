// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/corner_refinement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

namespace waymark {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

/// The ends of a side are left out, where the next one bends the edge.
constexpr double kEndShare = 0.12;
/// Steps of the search across a side.
constexpr double kStepPx = 0.25;
constexpr double kLeastReachPx = 2.25;
constexpr double kMostReachPx = 4.0;
constexpr int kLeastPlaces = 4;
constexpr int kMostPlaces = 48;
/// Half of what the slope is taken over.
constexpr double kHalfSpanPx = 0.75;
/// Least change of the grey value over that span that is an edge.
constexpr double kLeastSlope = 6.0;
/// Twice: the second time from where the first one led.
constexpr int kRounds = 2;

/// Grey value between pixels, bilinear; the place lies within the image.
double grey_at(ImageView image, const Eigen::Vector2d& place) {
  const int x = std::clamp(static_cast<int>(std::floor(place.x())), 0, image.width_px - 2);
  const int y = std::clamp(static_cast<int>(std::floor(place.y())), 0, image.height_px - 2);
  const double right = place.x() - x;
  const double down = place.y() - y;
  const double upper = (1.0 - right) * image.at(x, y) + right * image.at(x + 1, y);
  const double lower = (1.0 - right) * image.at(x, y + 1) + right * image.at(x + 1, y + 1);
  return (1.0 - down) * upper + down * lower;
}

bool is_inside(ImageView image, const Eigen::Vector2d& place) {
  return place.x() >= 0.0 && place.y() >= 0.0 && place.x() <= image.width_px - 1.0 &&
         place.y() <= image.height_px - 1.0;
}

/// Where the grey value rises most steeply within reach of a place, along a direction: the centre
/// of all that is more than half as steep, as slopes of sharp edges have a flat top.
std::optional<Eigen::Vector2d> steepest_rise(ImageView image,
                                             const Eigen::Vector2d& place,
                                             const Eigen::Vector2d& outward,
                                             double reach_px) {
  if (!is_inside(image, place + (reach_px + 1.0) * outward) ||
      !is_inside(image, place - (reach_px + 1.0) * outward)) {
    return std::nullopt;
  }
  const int count = 2 * static_cast<int>(std::ceil(reach_px / kStepPx)) + 1;
  const auto offset = [&](double index) { return (index - 0.5 * (count - 1)) * kStepPx; };
  std::vector<double> slopes;
  for (int i = 0; i < count; ++i) {
    slopes.push_back(grey_at(image, place + (offset(i) + kHalfSpanPx) * outward) -
                     grey_at(image, place + (offset(i) - kHalfSpanPx) * outward));
  }
  const auto most = std::max_element(slopes.begin(), slopes.end());
  const double half = 0.5 * *most;
  if (*most < kLeastSlope) return std::nullopt;
  const auto is_low = [&](double slope) { return slope < half; };
  const auto after = std::find_if(most, slopes.end(), is_low);
  const auto before = std::find_if(std::reverse_iterator(most), slopes.rend(), is_low);
  if (after == slopes.end() || before == slopes.rend()) return std::nullopt;  // Beyond reach.
  double sum = 0.0;
  double weights = 0.0;
  for (auto at = before.base(); at != after; ++at) {
    sum += (*at - half) * static_cast<double>(at - slopes.begin());
    weights += *at - half;
  }
  if (!(weights > 0.0)) return std::nullopt;
  return place + offset(sum / weights) * outward;
}

/// The normal of the plane through the camera and most of the bearings: least squares, then once
/// more without those that are far off.
std::optional<Eigen::Vector3d> fit_great_circle(std::vector<Eigen::Vector3d> bearings) {
  Eigen::Vector3d normal;
  for (int round = 0; round < kRounds; ++round) {
    if (bearings.size() < kLeastPlaces) return std::nullopt;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& bearing : bearings) sum += bearing * bearing.transpose();
    normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(0);
    std::vector<double> off;
    for (const Eigen::Vector3d& bearing : bearings) off.push_back(std::abs(normal.dot(bearing)));
    std::vector<double> sorted = off;
    std::nth_element(sorted.begin(), sorted.begin() + std::ssize(sorted) / 2, sorted.end());
    const double limit = 3.0 * sorted[sorted.size() / 2] + 1e-12;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      if (off[i] <= limit) bearings[kept++] = bearings[i];
    }
    bearings.resize(kept);
  }
  return normal;
}

std::vector<Eigen::Vector3d> bearings_of(const Camera& camera,
                                         const std::vector<Eigen::Vector2d>& pixels) {
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (is_valid[i]) bearings[kept++] = bearings[i];
  }
  bearings.resize(kept);
  return bearings;
}

/// The image of the straight line between two corners, at a part of the way.
std::optional<Eigen::Vector2d> between(const Camera& camera,
                                       const Eigen::Vector3d& from,
                                       const Eigen::Vector3d& to,
                                       double share) {
  const std::array<Eigen::Vector3d, 1> point = {(1.0 - share) * from + share * to};
  std::array<Eigen::Vector2d, 1> pixel;
  std::array<std::uint8_t, 1> is_visible;
  camera.project(point, pixel, is_visible);
  if (!is_visible[0]) return std::nullopt;
  return pixel[0];
}

std::optional<Eigen::Vector3d> fit_side(ImageView image,
                                        const Camera& camera,
                                        const Eigen::Vector3d& from,
                                        const Eigen::Vector3d& to,
                                        int side_modules) {
  const auto begin = between(camera, from, to, 0.0);
  const auto end = between(camera, from, to, 1.0);
  if (!begin || !end) return std::nullopt;
  const double length_px = (*end - *begin).norm();
  const double reach_px = std::clamp(0.6 * length_px / side_modules, kLeastReachPx, kMostReachPx);
  const int count = std::clamp(static_cast<int>(length_px), kLeastPlaces + 2, kMostPlaces);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < count; ++i) {
    const double share = kEndShare + (1.0 - 2.0 * kEndShare) * (i + 0.5) / count;
    const auto here = between(camera, from, to, share);
    const auto ahead = between(camera, from, to, share + 0.02);
    if (!here || !ahead) continue;
    const Eigen::Vector2d along = (*ahead - *here).normalized();
    // Clockwise as y points down: what lies to the left of the way is outside.
    const Eigen::Vector2d outward(along.y(), -along.x());
    if (const auto place = steepest_rise(image, *here, outward, reach_px)) places.push_back(*place);
  }
  if (std::ssize(places) < std::max(kLeastPlaces, count / 2)) return std::nullopt;
  return fit_great_circle(bearings_of(camera, places));
}

}  // namespace

std::optional<Corners> refine_marker_corners(ImageView image,
                                             const Camera& camera,
                                             const Corners& corners,
                                             int side_modules) {
  std::vector<Eigen::Vector3d> bearings = bearings_of(camera, {corners.begin(), corners.end()});
  if (bearings.size() != 4) return std::nullopt;
  for (int round = 0; round < kRounds; ++round) {
    std::array<Eigen::Vector3d, 4> normals;
    for (std::size_t side = 0; side < 4; ++side) {
      const auto normal =
          fit_side(image, camera, bearings[side], bearings[(side + 1) % 4], side_modules);
      if (!normal) return std::nullopt;
      normals[side] = *normal;
    }
    for (std::size_t corner = 0; corner < 4; ++corner) {
      Eigen::Vector3d meeting = normals[(corner + 3) % 4].cross(normals[corner]);
      if (!(meeting.norm() > 1e-6)) return std::nullopt;
      meeting.normalize();
      bearings[corner] = meeting.dot(bearings[corner]) < 0.0 ? Eigen::Vector3d(-meeting) : meeting;
    }
  }
  Corners refined;
  std::array<std::uint8_t, 4> is_visible;
  camera.project(bearings, refined, is_visible);
  for (std::size_t i = 0; i < 4; ++i) {
    const double side_px = std::min((corners[i] - corners[(i + 1) % 4]).norm(),
                                    (corners[i] - corners[(i + 3) % 4]).norm());
    const double most_px = std::max(1.5, 1.5 * side_px / side_modules);
    if (!is_visible[i] || !((refined[i] - corners[i]).norm() < most_px)) return std::nullopt;
  }
  return refined;
}

}  // namespace waymark
