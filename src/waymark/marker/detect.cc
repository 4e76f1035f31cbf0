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
#include "waymark/marker/outline.h"

namespace waymark {
namespace {

/// Smaller squares hold no number that could be read.
constexpr double kLeastSidePx = 5.0;

cv::Ptr<cv::aruco::DetectorParameters> parameters_for(ImageView image) {
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->minMarkerPerimeterRate =
      4.0 * kLeastSidePx / std::max(image.width_px, image.height_px);
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  return parameters;
}

/// Clockwise in the image, as y points down: mirrored squares are none.
bool is_clockwise(const std::array<Eigen::Vector2d, 4>& corners) {
  const Eigen::Vector2d a = corners[2] - corners[0];
  const Eigen::Vector2d b = corners[3] - corners[1];
  return a.x() * b.y() - a.y() * b.x() > 0.0;
}

std::optional<MarkerSighting> sighting_of(int id,
                                          const std::array<Eigen::Vector2d, 4>& corners,
                                          const Camera& camera,
                                          std::uint8_t camera_index) {
  constexpr std::array<float, 4> kLevelScales = {1.0f, 1.0f, 1.0f, 1.0f};
  TangentComputer computer;
  const TangentArrays& tangents = computer.compute(camera, corners, kLevelScales);
  MarkerSighting sighting;
  sighting.id = id;
  sighting.camera = camera_index;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!tangents.is_valid[i]) return std::nullopt;
    sighting.pixels[i] = corners[i].cast<float>();
    sighting.bearings[i] = tangents.bearings[i];
    sighting.pixel_from_bearing[i] = tangents.level_pixel_from_bearing[i];
  }
  return sighting;
}

}  // namespace

MarkerSightings MarkerDetector::detect(ImageView image,
                                       const Camera& camera,
                                       std::uint8_t camera_index) const {
  MarkerSightings sightings;
  if (image.width_px < 8 || image.height_px < 8) return sightings;
  // OpenCV wants a pointer to non-const values, but does not write to them.
  const cv::Mat mat(image.height_px,
                    image.width_px,
                    CV_8UC1,
                    const_cast<std::uint8_t*>(image.data),
                    static_cast<std::size_t>(image.stride));
  std::vector<std::vector<cv::Point2f>> outlines;
  std::vector<int> ids;
  cv::aruco::detectMarkers(mat,
                           cv::aruco::getPredefinedDictionary(family_.opencv_dictionary()),
                           outlines,
                           ids,
                           parameters_for(image));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    std::array<Eigen::Vector2d, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = {outlines[i][k].x, outlines[i][k].y};
    if (!is_clockwise(corners)) continue;
    const auto refined = refine_outline(image, camera, corners, family_.side_modules());
    if (!refined) continue;
    if (auto sighting = sighting_of(ids[i], *refined, camera, camera_index)) {
      sightings.push_back(*sighting);
    }
  }
  std::ranges::stable_sort(sightings, {}, &MarkerSighting::id);
  return sightings;
}

std::shared_ptr<const MarkerSightings> measure_anew(
    const std::shared_ptr<const MarkerSightings>& sightings, const Rig& rig) {
  if (!sightings) return nullptr;
  auto anew = std::make_shared<MarkerSightings>();
  for (const MarkerSighting& sighting : *sightings) {
    std::array<Eigen::Vector2d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = sighting.pixels[i].cast<double>();
    const Camera& camera = *rig.cameras.at(sighting.camera).camera;
    const auto measured = sighting_of(sighting.id, corners, camera, sighting.camera);
    if (measured) anew->push_back(*measured);
  }
  return anew->empty() ? nullptr : anew;
}

}  // namespace waymark
