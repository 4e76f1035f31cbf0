// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/exchange/openvslam_records.h"
#include "waymark/image/feature_geometry.h"
#include "waymark/image/pyramid.h"

namespace waymark {
namespace {

/// Standard deviation in 1/m of the inverse of a depth of which nothing else is known: that of
/// structured light (Khoshelham and Elberink 2012, section 5).
constexpr double kInverseDepthSigma = 1.43e-3;

/// Pixels of one camera of the rig; an entry that is not used is unspecified.
struct Pixels {
  std::vector<Eigen::Vector2d> pixels;
  std::vector<std::uint8_t> is_used;
};

/// From key points without distortion to the pixels of the image. On entry is_used says which of
/// them there are, on return which of those the camera sees.
void distort(const std::vector<double>& intrinsics, const Camera& camera, Pixels& points) {
  const std::size_t count = points.pixels.size();
  std::vector<std::uint8_t> is_visible(count);
  if (intrinsics.empty()) {
    for (std::size_t i = 0; i < count; ++i) is_visible[i] = camera.contains(points.pixels[i]);
  } else {
    const Eigen::Vector2d focal(intrinsics[0], intrinsics[1]);
    const Eigen::Vector2d center(intrinsics[2], intrinsics[3]);
    std::vector<Eigen::Vector3d> directions(count);
    for (std::size_t i = 0; i < count; ++i) {
      directions[i] << (points.pixels[i] - center).cwiseQuotient(focal), 1.0;
    }
    camera.project(directions, points.pixels, is_visible);
  }
  for (std::size_t i = 0; i < count; ++i) points.is_used[i] &= is_visible[i];
}

Pixels primary_pixels(const OpenvslamKeyframe& keyframe, const OpenvslamView& view) {
  Pixels points;
  for (const Keypoint& keypoint : keyframe.keypoints) {
    points.pixels.emplace_back(keypoint.x_px, keypoint.y_px);
  }
  points.is_used.assign(points.pixels.size(), 1);
  distort(view.undistorted_intrinsics, *view.rig->cameras[0].camera, points);
  return points;
}

/// The pair is rectified: the same row of camera 1, which has the same intrinsics.
Pixels right_pixels(const OpenvslamKeyframe& keyframe, const OpenvslamView& view) {
  Pixels points;
  points.pixels.resize(keyframe.keypoints.size());
  points.is_used.assign(keyframe.keypoints.size(), 0);
  if (view.setup != Setup::kStereo || keyframe.right_columns_px.empty()) return points;
  for (std::size_t i = 0; i < points.pixels.size(); ++i) {
    points.pixels[i] = {keyframe.right_columns_px[i], keyframe.keypoints[i].y_px};
    points.is_used[i] = keyframe.right_columns_px[i] >= 0.0f;
  }
  distort(view.undistorted_intrinsics, *view.rig->cameras[1].camera, points);
  return points;
}

/// The level of our pyramid at which pixels have the size nearest to those of one of theirs.
std::vector<std::uint8_t> nearest_levels(const OpenvslamPyramid& pyramid) {
  std::vector<std::uint8_t> levels;
  for (std::int64_t level = 0; level < pyramid.num_levels; ++level) {
    const double nearest = std::round(static_cast<double>(level) * std::log(pyramid.scale_factor) /
                                      std::log(Pyramid::kScaleFactor));
    levels.push_back(static_cast<std::uint8_t>(std::min(nearest, Pyramid::kNumLevels - 1.0)));
  }
  return levels;
}

void check_levels(const OpenvslamKeyframe& keyframe, const OpenvslamView& view) {
  for (std::size_t i = 0; i < keyframe.keypoints.size(); ++i) {
    if (keyframe.keypoints[i].level < view.pyramid.num_levels) continue;
    throw InputError(view.where,
                     fmt::format("undist_keypts[{}].oct is {}, expected a level below {}",
                                 i,
                                 keyframe.keypoints[i].level,
                                 view.pyramid.num_levels));
  }
}

void append_keypoint(Features& features,
                     Keypoint keypoint,
                     const Eigen::Vector2d& pixel,
                     std::uint8_t camera) {
  keypoint.x_px = static_cast<float>(pixel.x());
  keypoint.y_px = static_cast<float>(pixel.y());
  keypoint.camera = camera;
  features.keypoints.push_back(keypoint);
}

/// Ranges along the bearings from depths along z.
void set_ranges(const OpenvslamKeyframe& keyframe,
                Setup setup,
                const std::vector<std::uint32_t>& feature_of_keypoint,
                Features& features) {
  features.range_m.assign(features.num_primary, 0.0f);
  features.inverse_range_sigma.assign(features.num_primary, 0.0f);
  if (setup != Setup::kRgbd || keyframe.depths_m.empty()) return;
  for (std::size_t i = 0; i < keyframe.depths_m.size(); ++i) {
    const std::uint32_t feature = feature_of_keypoint[i];
    if (feature == kNoFeature || !(keyframe.depths_m[i] > 0.0f)) continue;
    const float z = features.bearings[feature].z();
    if (!(z > 0.0f)) continue;
    features.range_m[feature] = keyframe.depths_m[i] / z;
    features.inverse_range_sigma[feature] = static_cast<float>(z * kInverseDepthSigma);
  }
}

}  // namespace

OpenvslamFeatures convert_openvslam_features(const OpenvslamKeyframe& keyframe,
                                             const OpenvslamView& view) {
  check_levels(keyframe, view);
  const std::vector<std::uint8_t> levels = nearest_levels(view.pyramid);
  Pixels primary = primary_pixels(keyframe, view);
  Pixels right = right_pixels(keyframe, view);
  const std::size_t count = keyframe.keypoints.size();
  // Pixels at the rim may turn out to have no bearing, and go in another round.
  while (true) {
    Features features;
    OpenvslamFeatures result;
    result.feature_of_keypoint.assign(count, kNoFeature);
    std::vector<std::uint8_t*> is_used;
    for (std::size_t i = 0; i < count; ++i) {
      if (!primary.is_used[i]) continue;
      result.feature_of_keypoint[i] = static_cast<std::uint32_t>(features.size());
      Keypoint keypoint = keyframe.keypoints[i];
      keypoint.level = levels[keypoint.level];
      append_keypoint(features, keypoint, primary.pixels[i], 0);
      features.descriptors.push_back(keyframe.descriptors[i]);
      is_used.push_back(&primary.is_used[i]);
    }
    features.num_primary = features.size();
    features.partner.assign(features.num_primary, kNoFeature);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t feature = result.feature_of_keypoint[i];
      if (feature == kNoFeature || !right.is_used[i]) continue;
      features.partner[feature] = static_cast<std::uint32_t>(features.size());
      features.partner.push_back(feature);
      append_keypoint(features, features.keypoints[feature], right.pixels[i], 1);
      is_used.push_back(&right.is_used[i]);
    }
    const std::vector<std::uint8_t> is_valid = derive_geometry(*view.rig, features);
    for (std::size_t i = 0; i < is_valid.size(); ++i) *is_used[i] = is_valid[i];
    if (std::find(is_valid.begin(), is_valid.end(), 0) != is_valid.end()) continue;
    set_ranges(keyframe, view.setup, result.feature_of_keypoint, features);
    if (view.rig->cameras.size() == 2) measure_stereo_ranges(*view.rig, features);
    result.features = std::make_shared<const Features>(std::move(features));
    return result;
  }
}

}  // namespace waymark
