// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/tangent.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/features/pyramid.h"
#include "waymark/simulate/testing/points.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A landmark in the image of one camera, or (kNoLandmark) an outlier.
struct Sight {
  std::uint32_t landmark = kNoLandmark;
  std::uint32_t look = 0;  ///< Whose descriptor it has.
  Vector2d pixel = Vector2d::Zero();
  int level = 0;
  double angle_rad = 0.0;
  double response = 0.0;
  double range_m = 0.0;
};

/// Surfaces more slanted than this show no corners.
constexpr double kMinCosView = 0.2;
/// A landmark counts as hidden by what is nearer than this share of its distance.
constexpr double kHidingShare = 0.999;

bool is_hidden(const PointCloud& cloud, const PointLandmark& landmark, const Vector3d& eye) {
  const Vector3d ray = landmark.position - eye;
  if (!landmark.normal.isZero() && -ray.dot(landmark.normal) < kMinCosView * ray.norm())
    return true;
  if (!cloud.world) return false;
  const std::optional<WorldHit> hit = cloud.world->intersect(eye, ray);
  return hit && hit->hit.distance < kHidingShare;
}

/// Sees landmarks with one camera. Keeps nothing but buffers.
class Eye {
 public:
  Eye(const PointCloud& cloud, const Camera& camera, const Rigid3& cam_from_world)
      : cloud_(cloud), camera_(camera), cam_from_world_(cam_from_world) {}

  /// Exact sights of those of the landmarks that the camera sees at some level, in their order.
  std::vector<Sight> see(const std::vector<std::uint32_t>& landmarks) {
    std::vector<Vector3d> points;
    for (const std::uint32_t id : landmarks) {
      points.push_back(cam_from_world_ * cloud_.landmarks[id].position);
    }
    std::vector<Vector2d> pixels(points.size(), Vector2d::Zero());
    std::vector<Matrix23d> jacobians(points.size(), Matrix23d::Zero());
    std::vector<std::uint8_t> is_visible(points.size());
    camera_.project_with_jacobian(points, pixels, jacobians, is_visible);
    const std::vector<float> ones(points.size(), 1.0f);
    TangentComputer tangent;
    const TangentArrays& arrays = tangent.compute(camera_, pixels, ones);

    const Vector3d eye = cam_from_world_.origin_in_source();
    std::vector<Sight> sights;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PointLandmark& landmark = cloud_.landmarks[landmarks[i]];
      if (!is_visible[i] || !arrays.is_valid[i]) continue;
      const double range = points[i].norm();
      const double scale = landmark.size_m / (range * arrays.size_rad[i]);
      const int level =
          static_cast<int>(std::lround(std::log(scale) / std::log(Pyramid::kScaleFactor)));
      if (level < 0 || level >= Pyramid::kNumLevels || is_hidden(cloud_, landmark, eye)) continue;
      const Vector2d along = jacobians[i] * (cam_from_world_.rotation * landmark.tangent);
      const double angle = std::atan2(along.y(), along.x());
      sights.push_back(
          {landmarks[i], landmarks[i], pixels[i], level, angle, landmark.response, range});
    }
    return sights;
  }

 private:
  const PointCloud& cloud_;
  const Camera& camera_;
  Rigid3 cam_from_world_;
};

void add_pixel_noise(std::vector<Sight>& sights, double sigma, Rng& rng) {
  for (Sight& sight : sights) {
    const double scale = sigma * Pyramid::scale(sight.level);
    const double x = scale * rng.normal();
    sight.pixel += Vector2d(x, scale * rng.normal());
  }
}

Descriptor flip_bits(Descriptor descriptor, double probability, Rng& rng) {
  for (std::uint64_t& word : descriptor) {
    for (int bit = 0; bit < 64; ++bit) {
      if (rng.uniform() < probability) word ^= std::uint64_t{1} << bit;
    }
  }
  return descriptor;
}

Sight random_outlier(const PointCloud& cloud, const Camera& camera, Rng& rng) {
  Sight sight;
  sight.look = rng.below(static_cast<std::uint32_t>(cloud.landmarks.size()));
  const double x = rng.uniform(0.0, camera.width_px() - 1.0);
  sight.pixel = {x, rng.uniform(0.0, camera.height_px() - 1.0)};
  sight.level = static_cast<int>(rng.below(Pyramid::kNumLevels));
  sight.angle_rad = rng.uniform(-std::numbers::pi, std::numbers::pi);
  sight.response = rng.uniform();
  sight.range_m = rng.uniform(0.5, 10.0);
  return sight;
}

std::vector<std::uint8_t> valid_sights(const Camera& camera, const std::vector<Sight>& sights) {
  std::vector<Vector2d> pixels;
  for (const Sight& sight : sights) pixels.push_back(sight.pixel);
  const std::vector<float> ones(sights.size(), 1.0f);
  TangentComputer tangent;
  std::vector<std::uint8_t> is_valid = tangent.compute(camera, pixels, ones).is_valid;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (!camera.contains(sights[i].pixel)) is_valid[i] = 0;
  }
  return is_valid;
}

/// Drops sights that noise moved to where the camera has no bearing, or out of the image.
void keep_valid(const Camera& camera, std::vector<Sight>& sights) {
  const std::vector<std::uint8_t> is_valid = valid_sights(camera, sights);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (is_valid[i]) sights[kept++] = sights[i];
  }
  sights.resize(kept);
}

/// What a frame's extractor would give for camera 0, before bearings: noisy, limited in number,
/// ordered by level, row and column.
std::vector<Sight> primary_sights(
    const PointCloud& cloud, Eye& eye, const Camera& camera, const PointNoise& noise, Rng& rng) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t id = 0; id < cloud.landmarks.size(); ++id) {
    if (rng.uniform() >= noise.miss_probability) found.push_back(id);
  }
  std::vector<Sight> sights = eye.see(found);
  add_pixel_noise(sights, noise.pixel_sigma, rng);
  keep_valid(camera, sights);
  const std::size_t most = static_cast<std::size_t>(noise.max_features);
  const double inlier_share = 1.0 - noise.outlier_share;
  const std::size_t most_inliers = static_cast<std::size_t>(inlier_share * noise.max_features);
  std::stable_sort(sights.begin(), sights.end(), [](const Sight& a, const Sight& b) {
    return a.response > b.response;
  });
  if (sights.size() > most_inliers) sights.resize(most_inliers);
  const double num_outliers =
      noise.outlier_share / inlier_share * static_cast<double>(sights.size());
  for (int i = 0; i < static_cast<int>(std::lround(num_outliers)) && sights.size() < most; ++i) {
    sights.push_back(random_outlier(cloud, camera, rng));
  }
  std::stable_sort(sights.begin(), sights.end(), [](const Sight& a, const Sight& b) {
    return std::make_tuple(a.level, a.pixel.y(), a.pixel.x()) <
           std::make_tuple(b.level, b.pixel.y(), b.pixel.x());
  });
  return sights;
}

/// Appends keypoints, bearings, W and sizes of the features of one camera.
void append(const Camera& camera,
            std::uint8_t index,
            const std::vector<Sight>& sights,
            Features& features) {
  std::vector<Vector2d> pixels;
  std::vector<float> scales;
  for (const Sight& sight : sights) {
    Keypoint keypoint;
    keypoint.x_px = static_cast<float>(sight.pixel.x());
    keypoint.y_px = static_cast<float>(sight.pixel.y());
    keypoint.angle_rad = static_cast<float>(sight.angle_rad);
    keypoint.response = static_cast<float>(100.0 * sight.response);
    keypoint.level = static_cast<std::uint8_t>(sight.level);
    keypoint.camera = index;
    features.keypoints.push_back(keypoint);
    pixels.emplace_back(keypoint.x_px, keypoint.y_px);
    scales.push_back(static_cast<float>(Pyramid::scale(sight.level)));
  }
  TangentComputer tangent;
  const TangentArrays& arrays = tangent.compute(camera, pixels, scales);
  const auto extend = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  extend(features.bearings, arrays.bearings);
  extend(features.level_pixel_from_bearing, arrays.level_pixel_from_bearing);
  extend(features.size_rad, arrays.size_rad);
}

/// By which the features of camera 0 err, in pixels of their levels, per landmark.
std::map<std::uint32_t, Vector2d> errors_of_primary(const PointCloud& cloud,
                                                    const Rig& rig,
                                                    const Rigid3& world_from_rig,
                                                    const std::vector<std::uint32_t>& landmarks,
                                                    const std::vector<std::uint32_t>& feature_of,
                                                    const Features& features) {
  Eye eye(cloud, *rig.cameras[0].camera, rig.cameras[0].cam_from_rig * world_from_rig.inverse());
  std::map<std::uint32_t, Vector2d> errors;
  for (const Sight& sight : eye.see(landmarks)) {
    const Keypoint& found = features.keypoints[feature_of[sight.landmark]];
    errors[sight.landmark] =
        (Vector2d(found.x_px, found.y_px) - sight.pixel) / Pyramid::scale(found.level);
  }
  return errors;
}

/// Features of camera 1 are found again where those of camera 0 are: with their errors, and half as
/// much of their own.
void add_noise_of_pairs(std::vector<Sight>& sights,
                        const std::map<std::uint32_t, Vector2d>& errors,
                        double sigma,
                        Rng& rng) {
  add_pixel_noise(sights, 0.5 * sigma, rng);
  for (Sight& sight : sights)
    sight.pixel += Pyramid::scale(sight.level) * errors.at(sight.landmark);
}

void add_stereo(const PointCloud& cloud,
                const Rig& rig,
                const Rigid3& world_from_rig,
                const PointNoise& noise,
                Rng& rng,
                PointObservation& result,
                Features& features) {
  std::vector<std::uint32_t> landmarks;
  std::vector<std::uint32_t> feature_of(cloud.landmarks.size(), kNoFeature);
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    const std::uint32_t landmark = result.landmark_of_feature[i];
    if (landmark == kNoLandmark) continue;
    landmarks.push_back(landmark);
    feature_of[landmark] = i;
  }
  const Camera& camera = *rig.cameras[1].camera;
  Eye eye(cloud, camera, rig.cameras[1].cam_from_rig * world_from_rig.inverse());
  std::vector<Sight> sights = eye.see(landmarks);
  add_noise_of_pairs(sights,
                     errors_of_primary(cloud, rig, world_from_rig, landmarks, feature_of, features),
                     noise.pixel_sigma,
                     rng);
  keep_valid(camera, sights);
  append(camera, 1, sights, features);
  for (const Sight& sight : sights) {
    const std::uint32_t primary = feature_of[sight.landmark];
    const std::uint32_t secondary = static_cast<std::uint32_t>(features.partner.size());
    features.partner[primary] = secondary;
    features.partner.push_back(primary);
    result.landmark_of_feature.push_back(sight.landmark);
  }
  measure_stereo_ranges(rig, features);
}

void add_measured_range(const std::vector<Sight>& sights,
                        double inverse_sigma,
                        Rng& rng,
                        Features& features) {
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const double inverse = 1.0 / sights[i].range_m + inverse_sigma * rng.normal();
    if (inverse <= 0.0) continue;
    features.range_m[i] = static_cast<float>(1.0 / inverse);
    features.inverse_range_sigma[i] = static_cast<float>(inverse_sigma);
  }
}

}  // namespace

PointObservation observe(const PointCloud& cloud,
                         const std::shared_ptr<const Rig>& rig,
                         const Rigid3& world_from_rig,
                         const PointNoise& noise,
                         std::uint64_t frame) {
  WAYMARK_CHECK(!rig->cameras.empty() && !cloud.landmarks.empty());
  WAYMARK_CHECK(noise.outlier_share >= 0.0 && noise.outlier_share < 1.0);
  Rng rng(noise.seed, frame);
  const Camera& camera = *rig->cameras[0].camera;
  Eye eye(cloud, camera, rig->cameras[0].cam_from_rig * world_from_rig.inverse());
  std::vector<Sight> sights = primary_sights(cloud, eye, camera, noise, rng);
  keep_valid(camera, sights);

  PointObservation result;
  auto features = std::make_shared<Features>();
  features->rig = rig;
  features->num_primary = sights.size();
  append(camera, 0, sights, *features);
  for (const Sight& sight : sights) {
    const Descriptor& look = cloud.landmarks[sight.look].descriptor;
    features->descriptors.push_back(flip_bits(look, noise.flip_probability, rng));
    result.landmark_of_feature.push_back(sight.landmark);
  }
  features->partner.assign(sights.size(), kNoFeature);
  features->range_m.assign(sights.size(), 0.0f);
  features->inverse_range_sigma.assign(sights.size(), 0.0f);
  if (rig->cameras.size() > 1) {
    add_stereo(cloud, *rig, world_from_rig, noise, rng, result, *features);
  } else if (noise.inverse_range_sigma > 0.0) {
    add_measured_range(sights, noise.inverse_range_sigma, rng, *features);
  }
  features->grid =
      FeatureGrid(camera.width_px(),
                  camera.height_px(),
                  camera.wrap_width_px(),
                  sights.size(),
                  [&](std::size_t i) {
                    return std::pair(features->keypoints[i].x_px, features->keypoints[i].y_px);
                  });
  result.features = std::move(features);
  return result;
}

}  // namespace waymark
