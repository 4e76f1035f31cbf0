// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/alignment.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"

namespace waymark {
namespace {

// Ratio of the second to the first singular value below which points count as lying on a line.
constexpr double kMinSpread = 1e-9;

struct CentredMoments {
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  double variance_a = 0.0;                               // Umeyama 1991, eq. 36
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // b a^T, eq. 38
};

double weight_of(std::span<const double> weights, std::size_t i) {
  return weights.empty() ? 1.0 : weights[i];
}

std::optional<CentredMoments> centred_moments(std::span<const Eigen::Vector3d> points_a,
                                              std::span<const Eigen::Vector3d> points_b,
                                              std::span<const double> weights) {
  WAYMARK_CHECK(points_a.size() == points_b.size());
  WAYMARK_CHECK(weights.empty() || weights.size() == points_a.size());
  CentredMoments moments;
  double sum = 0.0;
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    const double weight = weight_of(weights, i);
    sum += weight;
    moments.mean_a += weight * points_a[i];
    moments.mean_b += weight * points_b[i];
  }
  if (!(sum > 0.0)) return std::nullopt;
  moments.mean_a /= sum;
  moments.mean_b /= sum;
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    const double weight = weight_of(weights, i) / sum;
    const Eigen::Vector3d a = points_a[i] - moments.mean_a;
    const Eigen::Vector3d b = points_b[i] - moments.mean_b;
    moments.variance_a += weight * a.squaredNorm();
    moments.covariance += weight * b * a.transpose();
  }
  return moments;
}

struct RotationFit {
  Eigen::Matrix3d rotation;
  double trace;  // of D S, by which the scale is derived
};

// R = U S V^T of the covariance U D V^T, where S repairs a reflection (Umeyama 1991, eq. 40, 43).
std::optional<RotationFit> fit_rotation(const Eigen::Matrix3d& covariance) {
  if (!covariance.allFinite()) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& singular = svd.singularValues();
  if (!(singular[1] > kMinSpread * singular[0])) return std::nullopt;
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) signs[2] = -1.0;
  return RotationFit{svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose(),
                     singular.dot(signs)};
}

std::optional<Sim3> align(std::span<const Eigen::Vector3d> points_a,
                          std::span<const Eigen::Vector3d> points_b,
                          std::span<const double> weights,
                          bool is_scale_free) {
  const std::optional<CentredMoments> moments = centred_moments(points_a, points_b, weights);
  if (!moments) return std::nullopt;
  const std::optional<RotationFit> fit = fit_rotation(moments->covariance);
  if (!fit) return std::nullopt;
  const double scale = is_scale_free ? fit->trace / moments->variance_a : 1.0;
  if (!(scale > 0.0) || !std::isfinite(scale)) return std::nullopt;
  const Eigen::Vector3d translation = moments->mean_b - scale * (fit->rotation * moments->mean_a);
  return Sim3(Eigen::Quaterniond(fit->rotation).normalized(), translation, scale);
}

// Index of the timestamp nearest to the given one; timestamps ascend and are not empty.
std::uint32_t nearest(std::span<const std::int64_t> timestamps_ns, std::int64_t timestamp_ns) {
  const auto after = std::lower_bound(timestamps_ns.begin(), timestamps_ns.end(), timestamp_ns);
  if (after == timestamps_ns.begin()) return 0;
  const auto index = static_cast<std::uint32_t>(after - timestamps_ns.begin());
  if (after == timestamps_ns.end()) return index - 1;
  return timestamp_ns - timestamps_ns[index - 1] <= *after - timestamp_ns ? index - 1 : index;
}

}  // namespace

std::optional<Eigen::Matrix3d> align_directions(std::span<const Eigen::Vector3d> directions_a,
                                                std::span<const Eigen::Vector3d> directions_b,
                                                std::span<const double> weights) {
  WAYMARK_CHECK(directions_a.size() == directions_b.size());
  WAYMARK_CHECK(weights.empty() || weights.size() == directions_a.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < directions_a.size(); ++i) {
    covariance += weight_of(weights, i) * directions_b[i] * directions_a[i].transpose();
  }
  const std::optional<RotationFit> fit = fit_rotation(covariance);
  if (!fit) return std::nullopt;
  return fit->rotation;
}

std::optional<Rigid3> align_rigid(std::span<const Eigen::Vector3d> points_a,
                                  std::span<const Eigen::Vector3d> points_b,
                                  std::span<const double> weights) {
  const std::optional<Sim3> result = align(points_a, points_b, weights, false);
  if (!result) return std::nullopt;
  return Rigid3(result->rotation, result->translation);
}

std::optional<Sim3> align_similarity(std::span<const Eigen::Vector3d> points_a,
                                     std::span<const Eigen::Vector3d> points_b,
                                     std::span<const double> weights) {
  return align(points_a, points_b, weights, true);
}

std::vector<PosePair> associate(std::span<const std::int64_t> timestamps_a_ns,
                                std::span<const std::int64_t> timestamps_b_ns,
                                std::int64_t max_difference_ns) {
  std::vector<PosePair> pairs;
  if (timestamps_b_ns.empty()) return pairs;
  const auto difference = [&](const PosePair& pair) {
    return std::abs(timestamps_a_ns[pair.a] - timestamps_b_ns[pair.b]);
  };
  for (std::uint32_t a = 0; a < timestamps_a_ns.size(); ++a) {
    const PosePair pair{a, nearest(timestamps_b_ns, timestamps_a_ns[a])};
    if (difference(pair) > max_difference_ns) continue;
    if (!pairs.empty() && pairs.back().b == pair.b) {
      // Both series ascend, so only neighbours can want the same pose.
      if (difference(pair) < difference(pairs.back())) pairs.back() = pair;
    } else {
      pairs.push_back(pair);
    }
  }
  return pairs;
}

}  // namespace waymark
