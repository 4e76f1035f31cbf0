// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/depth.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/features/features.h"
#include "waymark/features/pyramid.h"

namespace waymark {
namespace {

/// Structured light measures disparity with constant precision, so that the inverse depth has a
/// constant standard deviation (1/m): equation 10 and section 5 of Khoshelham and Elberink 2012.
constexpr double kSensorSigma = 1.43e-3;

/// Depth images of structured light are jagged at edges by about this much.
constexpr int kRadiusPx = 2;
constexpr std::size_t kMaxSamples = (2 * kRadiusPx + 1) * (2 * kRadiusPx + 1);

/// Fewer pixels than that are no surface but stray values.
constexpr std::size_t kMinSurfacePixels = 3;

/// Pixels whose rays are closer than this to sideways have no usable depth along z.
constexpr double kMinZPerRange = 0.05;

/// Between neighbours on one surface the range changes by less than this share, up to a slant of
/// about 80 degrees at the resolution of usual sensors; by more where one surface ends.
constexpr double kMaxRelativeStep = 0.02;

/// Standard deviation of the position of a corner; turns slant into uncertainty.
constexpr double kCornerSigmaPx = 0.5;
/// That of a point along its edge, where it is as good as anywhere in its cell.
constexpr double kAlongEdgeSigmaPx = 4.0;

Eigen::Vector2d along_edge_px(const Keypoint& keypoint) {
  const Eigen::Vector2d normal = edge_normal(keypoint.angle_rad).cast<double>();
  return kAlongEdgeSigmaPx * Eigen::Vector2d(-normal.y(), normal.x());
}

struct Sample {
  double inverse_range;
  double dx_px;  ///< From the keypoint.
  double dy_px;
};

struct DepthSamples {
  std::array<Sample, kMaxSamples> samples;
  std::size_t count = 0;
};

/// The z of unit bearings around a keypoint: what makes a range of a depth. To first order, which
/// also bends no straight wall: the inverse range of a plane is linear in the bearing.
struct ZPerRange {
  double at_keypoint;
  Eigen::Vector2d per_px;  ///< Change per pixel of level 0.

  double at(double dx_px, double dy_px) const {
    return at_keypoint + per_px.x() * dx_px + per_px.y() * dy_px;
  }
};

ZPerRange z_per_range(const Keypoint& keypoint,
                      const Eigen::Vector3f& bearing,
                      const Matrix23f& w) {
  const Eigen::Matrix2d gram = (w * w.transpose()).cast<double>();
  const Eigen::Vector2d per_level_px = gram.ldlt().solve(w.col(2).cast<double>());
  return {bearing.z(), per_level_px / Pyramid::scale(keypoint.level)};
}

struct InverseRange {
  double value;
  double sigma;
};

/// Keeps the samples in order, the nearest first, in the order of their coming among equals. So few
/// are sorted fastest by insertion, which unlike std::stable_sort allocates nothing.
void insert(const Sample& sample, DepthSamples& around) {
  std::size_t at = around.count++;
  for (; at > 0 && around.samples[at - 1].inverse_range < sample.inverse_range; --at) {
    around.samples[at] = around.samples[at - 1];
  }
  around.samples[at] = sample;
}

/// Measured pixels around the keypoint, the nearest surface first.
DepthSamples look_around(DepthView depth,
                         double factor,
                         const Keypoint& keypoint,
                         const ZPerRange& z) {
  DepthSamples around;
  const int center_x = static_cast<int>(std::lround(keypoint.x_px));
  const int center_y = static_cast<int>(std::lround(keypoint.y_px));
  const int last_y = std::min(center_y + kRadiusPx, depth.height_px - 1);
  const int last_x = std::min(center_x + kRadiusPx, depth.width_px - 1);
  for (int y = std::max(center_y - kRadiusPx, 0); y <= last_y; ++y) {
    const std::uint16_t* row = depth.row(y);
    for (int x = std::max(center_x - kRadiusPx, 0); x <= last_x; ++x) {
      if (row[x] == 0) continue;
      const double dx = x - keypoint.x_px, dy = y - keypoint.y_px;
      const double z_here = z.at(dx, dy);
      if (z_here < kMinZPerRange) continue;
      insert({factor / static_cast<double>(row[x]) * z_here, dx, dy}, around);
    }
  }
  return around;
}

/// The samples of the nearest surface: from the nearest on, up to the first gap.
std::span<const Sample> nearest_surface(const DepthSamples& around) {
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= around.count; ++i) {
    const double nearer = around.samples[i - 1].inverse_range;
    const bool ends = i == around.count || nearer - around.samples[i].inverse_range >
                                               kMaxRelativeStep * nearer + 3.0 * kSensorSigma;
    if (!ends) continue;
    if (i - begin >= kMinSurfacePixels) return {around.samples.data() + begin, i - begin};
    begin = i;
  }
  return {};
}

/// Inverse range at the keypoint. A plane in space is a plane in inverse range too; its slope times
/// the uncertainty of the keypoint, and what the plane leaves over, add to the sensor's noise.
/// Noise of neighbours is correlated, so that it does not average out. along_px: uncertainty of the
/// keypoint besides that of corners.
InverseRange fit_surface(std::span<const Sample> surface,
                         double quantum_m,
                         double z,
                         const Eigen::Vector2d& along_px) {
  const double count = static_cast<double>(surface.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Sample& s : surface) mean += Eigen::Vector3d(s.dx_px, s.dy_px, s.inverse_range);
  mean /= count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Sample& s : surface) {
    const Eigen::Vector3d d = Eigen::Vector3d(s.dx_px, s.dy_px, s.inverse_range) - mean;
    scatter += d * d.transpose() / count;
  }
  // The prior keeps the slope of a surface seen along a line or by a few pixels only at zero.
  constexpr double kPrior = 0.05;
  const Eigen::Matrix2d normal =
      scatter.topLeftCorner<2, 2>() + kPrior * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d slope = normal.ldlt().solve(scatter.topRightCorner<2, 1>());
  const double left_over = std::max(0.0, scatter(2, 2) - slope.dot(scatter.topRightCorner<2, 1>()));

  const double value = mean.z() - slope.dot(mean.head<2>());
  const double inverse_depth = value / z;
  const double quantum_sigma = quantum_m * inverse_depth * inverse_depth / std::sqrt(12.0);
  const double depth_variance = kSensorSigma * kSensorSigma + quantum_sigma * quantum_sigma;
  const double along = slope.dot(along_px);
  const double variance = z * z * depth_variance + left_over +
                          slope.squaredNorm() * kCornerSigmaPx * kCornerSigmaPx + along * along;
  return {value, std::sqrt(variance)};
}

std::optional<InverseRange> measure(DepthView depth,
                                    const DepthSettings& settings,
                                    const Keypoint& keypoint,
                                    const ZPerRange& z,
                                    const Eigen::Vector2d& along_px) {
  const DepthSamples around = look_around(depth, settings.factor, keypoint, z);
  const std::span<const Sample> surface = nearest_surface(around);
  if (surface.empty()) return std::nullopt;
  InverseRange fitted = fit_surface(surface, 1.0 / settings.factor, z.at_keypoint, along_px);
  fitted.value -= settings.inverse_offset * z.at_keypoint;
  if (!(fitted.value > 0.0)) return std::nullopt;
  return fitted;
}

}  // namespace

void sample_depth(DepthView depth,
                  const DepthSettings& settings,
                  std::span<const Keypoint> keypoints,
                  std::span<const Eigen::Vector3f> bearings,
                  std::span<const Matrix23f> level_pixel_from_bearing,
                  std::size_t num_edges,
                  FeatureArray<float>& range_m,
                  FeatureArray<float>& inverse_range_sigma) {
  WAYMARK_CHECK(bearings.size() == keypoints.size());
  WAYMARK_CHECK(level_pixel_from_bearing.size() == keypoints.size());
  range_m.assign(keypoints.size(), 0.0f);
  inverse_range_sigma.assign(keypoints.size(), 0.0f);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    if (bearings[i].z() < kMinZPerRange) continue;
    const ZPerRange z = z_per_range(keypoints[i], bearings[i], level_pixel_from_bearing[i]);
    const bool is_edge = i + num_edges >= keypoints.size();
    const Eigen::Vector2d along_px =
        is_edge ? along_edge_px(keypoints[i]) : Eigen::Vector2d::Zero();
    const std::optional<InverseRange> inverse = measure(depth, settings, keypoints[i], z, along_px);
    if (!inverse) continue;
    range_m[i] = static_cast<float>(1.0 / inverse->value);
    inverse_range_sigma[i] = static_cast<float>(inverse->sigma);
  }
}

}  // namespace waymark
