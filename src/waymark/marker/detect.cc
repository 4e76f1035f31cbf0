// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/detect.h"

#include <algorithm>
#include <array>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "waymark/camera/tangent.h"
#include "waymark/image/opencv_image.h"
#include "waymark/marker/corner_refinement.h"
#include "waymark/marker/pattern_fit.h"

namespace waymark {
namespace {

/// Smaller squares hold no number that could be read.
constexpr double kLeastSidePx = 5.0;
/// Of markers that are only confirmed.
constexpr double kLeastConfirmedPx = 4.0;
constexpr double kLeastFacing = 0.17;  ///< 80 degrees aside.
constexpr double kMostOffPx = 2.5;
constexpr double kMostOffShare = 0.1;

using Corners = std::array<Eigen::Vector2d, 4>;

cv::Ptr<cv::aruco::DetectorParameters> parameters_for(ImageView image) {
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->minMarkerPerimeterRate =
      4.0 * kLeastSidePx / std::max(image.width_px, image.height_px);
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  return parameters;
}

/// Clockwise in the image, as y points down: mirrored squares are none.
bool is_clockwise(const Corners& corners) {
  const Eigen::Vector2d a = corners[2] - corners[0];
  const Eigen::Vector2d b = corners[3] - corners[1];
  return a.x() * b.y() - a.y() * b.x() > 0.0;
}

std::optional<MarkerObservation> observation_of(int id,
                                                const Corners& corners,
                                                const Camera& camera,
                                                std::uint8_t camera_index) {
  constexpr std::array<float, 4> kLevelScales = {1.0f, 1.0f, 1.0f, 1.0f};
  TangentComputer computer;
  const TangentArrays& tangents = computer.compute(camera, corners, kLevelScales);
  MarkerObservation observation;
  observation.id = id;
  observation.camera = camera_index;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!tangents.is_valid[i]) return std::nullopt;
    observation.pixels[i] = corners[i].cast<float>();
    observation.bearings[i] = tangents.bearings[i];
    observation.pixel_from_bearing[i] = tangents.level_pixel_from_bearing[i];
  }
  return observation;
}

/// lengths by the side.
std::optional<Corners> project_corners(const Camera& camera, const Rigid3& cam_from_marker) {
  std::array<Eigen::Vector3d, 4> points;
  for (std::size_t i = 0; i < 4; ++i) points[i] = cam_from_marker * marker_corner(i, 1.0);
  Corners pixels;
  std::array<std::uint8_t, 4> is_visible;
  camera.project(points, pixels, is_visible);
  for (std::size_t i = 0; i < 4; ++i) {
    if (!is_visible[i] || !pixels[i].allFinite()) return std::nullopt;
  }
  return pixels;
}

double longest_side_px(const Corners& corners) {
  double longest = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    longest = std::max(longest, (corners[(i + 1) % 4] - corners[i]).norm());
  }
  return longest;
}

/// From before it, not too far aside, and large enough.
bool may_be_seen(const Rigid3& cam_from_marker, const Corners& corners) {
  const Eigen::Vector3d normal = cam_from_marker.rotation * Eigen::Vector3d::UnitZ();
  const double cosine = -normal.dot(cam_from_marker.translation.normalized());
  return cosine >= kLeastFacing && longest_side_px(corners) >= kLeastConfirmedPx;
}

/// What is further away is something else that looks alike.
bool are_near(const Corners& expected, const Corners& found) {
  const double limit = kMostOffPx + kMostOffShare * longest_side_px(expected);
  for (std::size_t i = 0; i < 4; ++i) {
    if ((found[i] - expected[i]).norm() > limit) return false;
  }
  return true;
}

}  // namespace

MarkerObservations MarkerDetector::detect(ImageView image,
                                          const Camera& camera,
                                          std::uint8_t camera_index) const {
  MarkerObservations observations;
  if (image.width_px < 8 || image.height_px < 8) return observations;
  std::vector<std::vector<cv::Point2f>> outlines;
  std::vector<int> ids;
  cv::aruco::detectMarkers(mat_of(image),
                           cv::aruco::getPredefinedDictionary(family_.opencv_dictionary()),
                           outlines,
                           ids,
                           parameters_for(image));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    Corners corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = {outlines[i][k].x, outlines[i][k].y};
    if (!is_clockwise(corners)) continue;
    const auto refined = refine_marker_corners(image, camera, corners, family_.side_modules());
    if (!refined) continue;
    if (auto observation = observation_of(ids[i], *refined, camera, camera_index)) {
      observations.push_back(*observation);
    }
  }
  std::ranges::stable_sort(observations, {}, &MarkerObservation::id);
  return observations;
}

MarkerObservations MarkerDetector::confirm(ImageView image,
                                           const Camera& camera,
                                           std::uint8_t camera_index,
                                           std::span<const ExpectedMarker> expected) const {
  MarkerObservations observations;
  for (const ExpectedMarker& marker : expected) {
    if (marker.id < 0 || marker.id >= family_.size() || !(marker.side > 0.0)) continue;
    Rigid3 cam_from_marker = marker.cam_from_marker;
    cam_from_marker.translation /= marker.side;
    const auto before = project_corners(camera, cam_from_marker);
    if (!before || !may_be_seen(cam_from_marker, *before)) continue;
    const auto fit = fit_pattern(image, camera, family_, marker.id, cam_from_marker);
    if (!fit) continue;
    const auto after = project_corners(camera, fit->cam_from_marker);
    if (!after || !are_near(*before, *after)) continue;
    if (!is_own_pattern(image, camera, family_, marker.id, *fit)) continue;
    if (auto observation = observation_of(marker.id, *after, camera, camera_index)) {
      observations.push_back(*observation);
    }
  }
  return observations;
}

std::shared_ptr<const MarkerObservations> recompute(
    const std::shared_ptr<const MarkerObservations>& observations, const Rig& rig) {
  if (!observations) return nullptr;
  auto anew = std::make_shared<MarkerObservations>();
  for (const MarkerObservation& observation : *observations) {
    Corners corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = observation.pixels[i].cast<double>();
    const Camera& camera = *rig.cameras.at(observation.camera).camera;
    const auto measured = observation_of(observation.id, corners, camera, observation.camera);
    if (measured) anew->push_back(*measured);
  }
  return anew->empty() ? nullptr : anew;
}

}  // namespace waymark
