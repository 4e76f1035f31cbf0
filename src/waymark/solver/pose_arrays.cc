// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/solver/pose_kernel.h"

namespace waymark {

namespace {

using Arrays = PoseWorkspace::Arrays;

bool is_usable(const Rig& rig, const PoseObservations& observations, std::size_t i) {
  return observations.camera[i] < rig.cameras.size() &&
         observations.point_in_world[i].allFinite() && observations.bearing[i].allFinite() &&
         observations.level_pixel_from_bearing[i].allFinite();
}

void check_sizes(const PoseObservations& observations) {
  const std::size_t size = observations.size();
  WAYMARK_CHECK(observations.bearing.size() == size);
  WAYMARK_CHECK(observations.level_pixel_from_bearing.size() == size);
  WAYMARK_CHECK(observations.camera.size() == size);
  WAYMARK_CHECK(observations.inverse_range.empty() || observations.inverse_range.size() == size);
  WAYMARK_CHECK(observations.inverse_range_sigma.size() == observations.inverse_range.size());
}

void append(const PoseObservations& observations, std::size_t i, Arrays& arrays) {
  auto& fields = arrays.fields;
  const auto& point = observations.point_in_world[i];
  const auto& bearing = observations.bearing[i];
  const auto& w = observations.level_pixel_from_bearing[i];
  for (int axis = 0; axis < 3; ++axis) {
    fields[kPointX + axis].push_back(point[axis]);
    fields[kBearingX + axis].push_back(bearing[axis]);
    fields[kW00 + axis].push_back(w(0, axis));
    fields[kW10 + axis].push_back(w(1, axis));
  }
  double inverse_range = 0.0;
  double scale = 0.0;
  if (!observations.inverse_range.empty() && observations.inverse_range_sigma[i] > 0.0f &&
      std::isfinite(observations.inverse_range[i])) {
    inverse_range = observations.inverse_range[i];
    scale = 1.0 / observations.inverse_range_sigma[i];
  }
  fields[kInverseRange].push_back(inverse_range);
  fields[kInverseRangeScale].push_back(scale);
  fields[kWeight].push_back(1.0);
  arrays.observation.push_back(static_cast<std::uint32_t>(i));
}

void pad(Arrays& arrays) {
  while (arrays.observation.size() % kPoseLanes != 0) {
    for (auto& field : arrays.fields) field.push_back(0.0);
    arrays.observation.push_back(UINT32_MAX);
  }
}

}  // namespace

void PoseObservations::add(const Eigen::Vector3d& point, const Measurement& measured) {
  point_in_world.push_back(point);
  bearing.push_back(measured.bearing);
  level_pixel_from_bearing.push_back(measured.level_pixel_from_bearing);
  camera.push_back(measured.camera);
  inverse_range.push_back(measured.inverse_range);
  inverse_range_sigma.push_back(measured.inverse_range_sigma);
}

void PoseObservations::clear() {
  point_in_world.clear();
  bearing.clear();
  level_pixel_from_bearing.clear();
  camera.clear();
  inverse_range.clear();
  inverse_range_sigma.clear();
}

PoseWorkspace::PoseWorkspace() : arrays_(std::make_unique<Arrays>()) {}
PoseWorkspace::~PoseWorkspace() = default;
PoseWorkspace::PoseWorkspace(PoseWorkspace&&) noexcept = default;
PoseWorkspace& PoseWorkspace::operator=(PoseWorkspace&&) noexcept = default;

std::size_t gather_pose_observations(const Rig& rig,
                                     const PoseObservations& observations,
                                     Arrays& arrays) {
  check_sizes(observations);
  for (auto& field : arrays.fields) field.clear();
  arrays.observation.clear();
  arrays.segments.clear();
  arrays.is_inlier.assign(observations.size(), 0);
  std::size_t num_usable = 0;
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    PoseSegment segment = {camera, arrays.observation.size(), 0, false};
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (observations.camera[i] != camera || !is_usable(rig, observations, i)) continue;
      append(observations, i, arrays);
      segment.has_ranges |= arrays.fields[kInverseRangeScale].back() > 0.0;
      ++num_usable;
    }
    pad(arrays);
    segment.end = arrays.observation.size();
    if (segment.end > segment.begin) arrays.segments.push_back(segment);
  }
  arrays.squared_residual.assign(arrays.observation.size(), 0.0);
  return num_usable;
}

PoseClasses classify_pose_observations(double gate, Arrays& arrays) {
  PoseClasses classes;
  for (std::size_t i = 0; i < arrays.observation.size(); ++i) {
    const std::uint32_t observation = arrays.observation[i];
    if (observation == UINT32_MAX) continue;
    const bool is_inlier = arrays.squared_residual[i] < gate;
    classes.num_changed += arrays.is_inlier[observation] != is_inlier;
    arrays.is_inlier[observation] = is_inlier;
    arrays.fields[kWeight][i] = is_inlier ? 1.0 : 0.0;
    classes.num_inliers += is_inlier;
  }
  return classes;
}

}  // namespace waymark
