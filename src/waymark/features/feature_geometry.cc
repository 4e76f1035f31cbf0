// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/feature_geometry.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/tangent.h"
#include "waymark/features/pyramid.h"
#include "waymark/features/range_precision.h"
#include "waymark/features/rolling_shutter.h"
#include "waymark/features/stereo_curve.h"

namespace waymark {
namespace {

struct GeometryWorkspace {
  TangentComputer tangents;
  std::vector<std::size_t> indices;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<float> level_scales;
};

void derive_of_camera(std::size_t index,
                      const Camera& camera,
                      GeometryWorkspace& workspace,
                      Features& features,
                      std::vector<std::uint8_t>& is_valid) {
  workspace.indices.clear();
  workspace.pixels.clear();
  workspace.level_scales.clear();
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint& keypoint = features.keypoints[i];
    if (keypoint.camera != index) continue;
    workspace.indices.push_back(i);
    workspace.pixels.emplace_back(keypoint.x_px, keypoint.y_px);
    workspace.level_scales.push_back(static_cast<float>(Pyramid::scale(keypoint.level)));
  }
  const TangentArrays& tangents =
      workspace.tangents.compute(camera, workspace.pixels, workspace.level_scales);
  for (std::size_t k = 0; k < workspace.indices.size(); ++k) {
    const std::size_t i = workspace.indices[k];
    is_valid[i] = tangents.is_valid[k];
    features.bearings[i] = tangents.bearings[k];
    features.level_pixel_from_bearing[i] = tangents.level_pixel_from_bearing[k];
    features.size_rad[i] = tangents.size_rad[k];
  }
}

/// Of the depth image, which measures along z. before: the same with the bearings that the ranges
/// were measured along.
void derive_depth_ranges(const Features& before, Features& features) {
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    if (features.partner[i] != kNoFeature || features.inverse_range_sigma[i] == 0.0f) continue;
    const float factor = before.bearings[i].z() / features.bearings[i].z();
    features.range_m[i] *= factor;
    features.inverse_range_sigma[i] /= factor;
  }
}

}  // namespace

std::vector<std::uint8_t> derive_geometry(const Rig& rig, Features& features) {
  WAYMARK_CHECK(!rig.cameras.empty() && features.num_primary <= features.size());
  for (const Keypoint& keypoint : features.keypoints) {
    WAYMARK_CHECK(keypoint.camera < rig.cameras.size() && keypoint.level < Pyramid::kNumLevels);
  }
  std::vector<std::uint8_t> is_valid(features.size(), 0);
  features.bearings.resize(features.size());
  features.level_pixel_from_bearing.resize(features.size());
  features.size_rad.resize(features.size());
  GeometryWorkspace workspace;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    derive_of_camera(c, *rig.cameras[c].camera, workspace, features, is_valid);
  }
  keep_across(features);
  const Camera& camera = *rig.cameras[0].camera;
  features.grid =
      FeatureGrid(camera.width_px(),
                  camera.height_px(),
                  camera.wrap_width_px(),
                  features.num_primary,
                  [&](std::size_t i) {
                    return std::pair(features.keypoints[i].x_px, features.keypoints[i].y_px);
                  });
  return is_valid;
}

void keep_across(Features& features) {
  for (std::size_t i = features.num_corners(); i < features.num_primary; ++i) {
    Matrix23f& w = features.level_pixel_from_bearing[i];
    w = across_edge(w, features.keypoints[i].angle_rad);
  }
}

Eigen::Vector3d edge_normal_in_cam(const Features& features, std::size_t feature) {
  const Eigen::Vector2f normal = edge_normal(features.keypoints[feature].angle_rad);
  return (features.level_pixel_from_bearing[feature].transpose() * normal)
      .cast<double>()
      .normalized();
}

void measure_stereo_ranges(const Rig& rig, Features& features) {
  constexpr double kFarAway = 1e9;  // In metres: as good as infinite.
  const Rigid3 cam1_from_cam0 = rig.cameras[1].cam_from_rig * rig.cameras[0].cam_from_rig.inverse();
  const BearingError& error = rig.cameras[1].bearing_error;
  for (std::size_t i = 0; i < features.num_primary; ++i) {
    const std::uint32_t partner = features.partner[i];
    if (partner == kNoFeature) continue;
    features.range_m[i] = features.inverse_range_sigma[i] = 0.0f;
    const EpipolarRay ray(cam1_from_cam0, features.bearings[i].cast<double>().normalized());
    const Eigen::Vector3d seen = features.bearings[partner].cast<double>();
    const double angle_rad =
        std::atan2(seen.dot(ray.toward), seen.dot(ray.infinity)) - error.at(seen)[0];
    const double off_rad = kStereoSigmaPx * features.size_rad[partner];
    const double inverse_range = ray.inverse_range(angle_rad);
    const double sigma =
        0.5 * (ray.inverse_range(angle_rad + off_rad) - ray.inverse_range(angle_rad - off_rad));
    if (!(static_cast<float>(sigma) > 0.0f)) continue;
    features.range_m[i] = static_cast<float>(std::clamp(1.0 / inverse_range, -kFarAway, kFarAway));
    features.inverse_range_sigma[i] = static_cast<float>(sigma);
  }
}

namespace {

/// Frees the ranges of a depth image of another offset than before.
void correct_depth(double inverse_offset, Features& features) {
  const auto offset = static_cast<float>(inverse_offset);
  const float change = offset - std::exchange(features.inverse_depth_offset, offset);
  if (change == 0.0f) return;
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    if (features.inverse_range_sigma[i] == 0.0f) continue;
    const float inverse_range = 1.0f / features.range_m[i] - change * features.bearings[i].z();
    if (!(inverse_range > 0.0f)) features.inverse_range_sigma[i] = 0.0f;
    features.range_m[i] = inverse_range > 0.0f ? 1.0f / inverse_range : 0.0f;
  }
}

/// What follows from pixels that are elsewhere than before, or in other cameras.
void derive_anew(const Rig& rig, const Features& before, bool is_moved, Features& features) {
  const std::vector<std::uint8_t> is_valid = derive_geometry(rig, features);
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (is_valid[i]) continue;
    features.bearings[i] = before.bearings[i];
    features.level_pixel_from_bearing[i] = before.level_pixel_from_bearing[i];
    features.size_rad[i] = before.size_rad[i];
  }
  // What was seen a moment before is as far away.
  if (!is_moved) derive_depth_ranges(before, features);
  if (rig.cameras.size() == 2) measure_stereo_ranges(rig, features);
}

}  // namespace

std::shared_ptr<const Features> recompute(const Features& features,
                                          std::shared_ptr<const Rig> rig,
                                          const RigMotion& motion) {
  Features still = features;
  if (rig->cameras.size() == 1) correct_depth(rig->inverse_depth_offset, still);
  derive_anew(*rig, features, false, still);
  auto anew = std::make_shared<Features>(still);
  if (correct_rolling(*rig, motion, *anew)) derive_anew(*rig, still, true, *anew);
  anew->rig = std::move(rig);
  return anew;
}

std::shared_ptr<const Features> moved(std::shared_ptr<const Features> features,
                                      const RigMotion& motion) {
  if (features->motion == motion) return features;
  const Rig& rig = *features->rig;
  auto anew = std::make_shared<Features>(*features);
  if (correct_rolling(rig, motion, *anew)) derive_anew(rig, *features, true, *anew);
  return anew;
}

namespace {

template <class T>
void insert_at(FeatureArray<T>& values, std::size_t at, std::size_t count, const T& value) {
  values.insert(values.begin() + static_cast<std::ptrdiff_t>(at), count, value);
}

}  // namespace

Features with_points(const Features& features,
                     std::span<const Keypoint> keypoints,
                     std::span<const Descriptor> descriptors) {
  WAYMARK_CHECK(keypoints.size() == descriptors.size());
  const std::size_t at = features.num_corners();
  const std::size_t count = keypoints.size();
  Features result = features;
  const auto offset = static_cast<std::ptrdiff_t>(at);
  result.keypoints.insert(result.keypoints.begin() + offset, keypoints.begin(), keypoints.end());
  result.descriptors.insert(
      result.descriptors.begin() + offset, descriptors.begin(), descriptors.end());
  insert_at(result.partner, at, count, kNoFeature);
  insert_at(result.range_m, at, count, 0.0f);
  insert_at(result.inverse_range_sigma, at, count, 0.0f);
  result.num_primary += count;
  for (std::uint32_t& partner : result.partner) {
    if (partner != kNoFeature && partner >= at) partner += static_cast<std::uint32_t>(count);
  }
  derive_geometry(*features.rig, result);
  return result;
}

}  // namespace waymark
