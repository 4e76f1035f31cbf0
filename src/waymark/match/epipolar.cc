// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/epipolar.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "waymark/base/check.h"
#include "waymark/match/nearest.h"

namespace waymark {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
/// Closer to the epipole than this the azimuth says nothing and depth is ill-conditioned.
constexpr float kMinAxisAngle = 0.03f;
/// How much the sizes of the two features may differ beyond what the distances explain.
constexpr float kMaxEpipolarSizeRatio = 1.6f;

/// Orthonormal axes with the baseline, from a to b, as third.
Eigen::Matrix3f baseline_axes(const Eigen::Vector3d& centre_of_b_in_a) {
  const Eigen::Vector3f axis = centre_of_b_in_a.normalized().cast<float>();
  const Eigen::Vector3f first = axis.unitOrthogonal();
  Eigen::Matrix3f axes;
  axes << first.transpose(), axis.cross(first).transpose(), axis.transpose();
  return axes;
}

}  // namespace

std::span<const FeatureMatch> EpipolarMatcher::match(const Features& a,
                                                     std::span<const std::uint8_t> is_taken_a,
                                                     const Features& b,
                                                     std::span<const std::uint8_t> is_taken_b,
                                                     const Rigid3& b_from_a,
                                                     const EpipolarOptions& options) {
  WAYMARK_CHECK(is_taken_a.size() >= a.num_primary && is_taken_b.size() >= b.num_primary);
  const Eigen::Matrix3f axes_from_a = baseline_axes(b_from_a.origin_in_source());
  const Eigen::Matrix3f axes_from_b =
      axes_from_a * b_from_a.rotation_matrix().transpose().cast<float>();
  const auto to_polar = [](const Eigen::Vector3f& v, std::uint32_t feature) {
    const float across = std::hypot(v.x(), v.y());
    return Polar{std::atan2(v.y(), v.x()), std::atan2(across, v.z()), feature};
  };
  polar_b_.clear();
  for (std::uint32_t i = 0; i < b.num_corners(); ++i) {
    if (!is_taken_b[i]) polar_b_.push_back(to_polar(axes_from_b * b.bearings[i], i));
  }
  std::sort(polar_b_.begin(), polar_b_.end(), [](const Polar& l, const Polar& r) {
    return l.azimuth_rad != r.azimuth_rad ? l.azimuth_rad < r.azimuth_rad : l.feature < r.feature;
  });
  best_of_b_.assign(b.num_primary, FeatureMatch{kNoFeature, kNoFeature, UINT16_MAX});
  for (std::uint32_t i = 0; i < a.num_corners(); ++i) {
    if (!is_taken_a[i]) choose(to_polar(axes_from_a * a.bearings[i], i), a, b, options);
  }
  matches_.clear();
  for (const FeatureMatch& match : best_of_b_) {
    if (match.a != kNoFeature) matches_.push_back(match);
  }
  return matches_;
}

void EpipolarMatcher::choose(const Polar& polar,
                             const Features& a,
                             const Features& b,
                             const EpipolarOptions& options) {
  const float sin_a = std::sin(polar.axis_angle_rad);
  if (sin_a < kMinAxisAngle) return;
  const float size_a = a.size_rad[polar.feature];
  const auto error = static_cast<float>(options.max_error_px);
  candidates_.clear();
  const auto consider = [&](const Polar& other, float azimuth_difference) {
    const float parallax = other.axis_angle_rad - polar.axis_angle_rad;
    const float size_b = b.size_rad[other.feature];
    if (parallax < options.min_parallax_px * std::max(size_a, size_b)) return;
    if (parallax > options.max_parallax_rad) return;
    const float sin_b = std::sin(other.axis_angle_rad);
    if (azimuth_difference * std::min(sin_a, sin_b) > error * std::max(size_a, size_b)) return;
    // Law of sines: the distances from a and b are as sin_b to sin_a.
    const float size_ratio = size_b * sin_a / (size_a * sin_b);
    if (size_ratio > kMaxEpipolarSizeRatio || size_ratio < 1.0f / kMaxEpipolarSizeRatio) return;
    candidates_.push_back(other.feature);
  };
  // Sizes of b may be coarser than a's by the allowed ratio.
  const float tolerance = std::min(error * size_a * 2.0f * kMaxEpipolarSizeRatio / sin_a, kPi);
  for (const float turn : {-2.0f * kPi, 0.0f, 2.0f * kPi}) {
    const float centre = polar.azimuth_rad + turn;
    auto it = std::lower_bound(
        polar_b_.begin(), polar_b_.end(), centre - tolerance, [](const Polar& p, float azimuth) {
          return p.azimuth_rad < azimuth;
        });
    for (; it != polar_b_.end() && it->azimuth_rad <= centre + tolerance; ++it) {
      consider(*it, std::abs(it->azimuth_rad - centre));
    }
  }
  if (candidates_.empty()) return;
  const auto nearest = find_nearest(
      a.descriptors[polar.feature], b.descriptors, candidates_, options.appearance, distances_);
  if (!nearest) return;
  FeatureMatch& owner = best_of_b_[nearest->feature];
  if (nearest->distance < owner.distance)
    owner = {polar.feature, nearest->feature, nearest->distance};
}

}  // namespace waymark
