// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/feature_geometry.h"

#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/tangent.h"
#include "waymark/geometry/triangulation.h"
#include "waymark/image/pyramid.h"

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

/// Below this disparity, in pixels of the level, a feature may as well be infinitely far away.
constexpr double kMinStereoDisparityPx = 0.5;

/// Range of a primary feature from its partner in camera 1; 0 where that is unknown.
float stereo_range_m(const Rig& rig, const Features& features, std::uint32_t feature) {
  const Rigid3 cam0_from_cam1 = rig.cameras[0].cam_from_rig * rig.cameras[1].cam_from_rig.inverse();
  const auto point = triangulate(features.bearings[feature].cast<double>(),
                                 features.bearings[features.partner[feature]].cast<double>(),
                                 cam0_from_cam1,
                                 kMinStereoDisparityPx * features.size_rad[feature]);
  return point ? static_cast<float>(point->norm()) : 0.0f;
}

/// before: the same with the bearings that the ranges were measured along.
void derive_ranges(const Rig& rig, const Features& before, Features& features) {
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    if (features.partner[i] != kNoFeature) {
      features.range_m[i] = stereo_range_m(rig, features, i);
    } else if (features.inverse_range_sigma[i] > 0.0f) {
      // What is measured is the depth along z.
      const float factor = before.bearings[i].z() / features.bearings[i].z();
      features.range_m[i] *= factor;
      features.inverse_range_sigma[i] /= factor;
    }
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

std::shared_ptr<const Features> measure_anew(const Features& features, const Rig& rig) {
  auto anew = std::make_shared<Features>(features);
  const std::vector<std::uint8_t> is_valid = derive_geometry(rig, *anew);
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (is_valid[i]) continue;
    anew->bearings[i] = features.bearings[i];
    anew->level_pixel_from_bearing[i] = features.level_pixel_from_bearing[i];
    anew->size_rad[i] = features.size_rad[i];
  }
  derive_ranges(rig, features, *anew);
  return anew;
}

}  // namespace waymark
