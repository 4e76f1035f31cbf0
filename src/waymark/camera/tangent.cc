// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/tangent.h"

#include <cmath>
#include <optional>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// An inverse distortion that has not converged must not pass for a bearing.
constexpr double kMaxRoundTripPx = 0.25;

double reprojection_error(const Camera& camera,
                          const Eigen::Vector2d& pixel,
                          const Eigen::Vector2d& reprojected) {
  Eigen::Vector2d error = reprojected - pixel;
  if (camera.wrap_width_px() > 0.0) error.x() = std::remainder(error.x(), camera.wrap_width_px());
  return error.norm();
}

struct SquaredSingularValues {
  double larger;
  double smaller;

  /// Works on J J^T, a symmetric 2x2 matrix whose eigenvalues are the squares of the singular
  /// values.
  explicit SquaredSingularValues(const Matrix23d& jacobian) {
    const double a = jacobian.row(0).squaredNorm();
    const double b = jacobian.row(0).dot(jacobian.row(1));
    const double c = jacobian.row(1).squaredNorm();
    larger = 0.5 * (a + c) + std::hypot(0.5 * (a - c), b);
    smaller = (a * c - b * b) / larger;
  }

  bool is_bounded() const {
    return larger <= TangentComputer::kMaxStretch * TangentComputer::kMaxStretch * smaller;
  }
};

struct BoundedTangent {
  Matrix23d pixel_from_bearing;
  double pixels_per_rad;  ///< Geometric mean over the two directions.
};

/// Lowers the larger singular value of the Jacobian to kMaxStretch times the smaller one. Nothing
/// where the Jacobian is not finite or has lost a rank.
std::optional<BoundedTangent> bound_tangent(const Matrix23d& jacobian) {
  const SquaredSingularValues squared(jacobian);
  if (!std::isfinite(squared.larger) || !(squared.smaller > 1e-12 * squared.larger)) {
    return std::nullopt;
  }
  if (squared.is_bounded()) {
    return BoundedTangent{jacobian, std::sqrt(std::sqrt(squared.larger * squared.smaller))};
  }
  // Eigenvector of the larger value; of the two equivalent forms the longer one is exact.
  const double a = jacobian.row(0).squaredNorm();
  const double b = jacobian.row(0).dot(jacobian.row(1));
  const double c = jacobian.row(1).squaredNorm();
  Eigen::Vector2d direction =
      a >= c ? Eigen::Vector2d(squared.larger - c, b) : Eigen::Vector2d(b, squared.larger - a);
  direction.normalize();
  constexpr double kMax = TangentComputer::kMaxStretch;
  const double shrink = std::sqrt(kMax * kMax * squared.smaller / squared.larger);
  const Eigen::RowVector3d along = direction.transpose() * jacobian;
  return BoundedTangent{jacobian - (1.0 - shrink) * direction * along,
                        std::sqrt(kMax * squared.smaller)};
}

}  // namespace

bool TangentComputer::is_stretched(const Matrix23d& pixel_from_bearing) {
  return !SquaredSingularValues(pixel_from_bearing).is_bounded();
}

const TangentArrays& TangentComputer::compute(const Camera& camera,
                                              std::span<const Eigen::Vector2d> pixels,
                                              std::span<const float> level_scales) {
  const std::size_t count = pixels.size();
  WAYMARK_CHECK(level_scales.size() == count);
  bearings_.resize(count);
  reprojected_.resize(count);
  jacobians_.resize(count);
  is_visible_.resize(count);
  arrays_.bearings.resize(count);
  arrays_.level_pixel_from_bearing.resize(count);
  arrays_.size_rad.resize(count);
  arrays_.is_valid.resize(count);

  camera.unproject(pixels, bearings_, arrays_.is_valid);
  for (std::size_t i = 0; i < count; ++i) {
    if (!arrays_.is_valid[i]) bearings_[i] = Eigen::Vector3d::UnitZ();
  }
  camera.project_with_jacobian(bearings_, reprojected_, jacobians_, is_visible_);
  for (std::size_t i = 0; i < count; ++i) {
    arrays_.is_valid[i] = arrays_.is_valid[i] && is_visible_[i] &&
                          reprojection_error(camera, pixels[i], reprojected_[i]) < kMaxRoundTripPx;
    if (!arrays_.is_valid[i]) continue;
    const Eigen::Vector3d& bearing = bearings_[i];
    const Matrix23d in_tangent_plane =
        jacobians_[i] - (jacobians_[i] * bearing) * bearing.transpose();
    const std::optional<BoundedTangent> bounded = bound_tangent(in_tangent_plane);
    arrays_.is_valid[i] = bounded.has_value();
    if (!bounded) continue;
    const double scale = level_scales[i];
    arrays_.bearings[i] = bearing.cast<float>();
    arrays_.level_pixel_from_bearing[i] = (bounded->pixel_from_bearing / scale).cast<float>();
    arrays_.size_rad[i] = static_cast<float>(scale / bounded->pixels_per_rad);
  }
  return arrays_;
}

}  // namespace waymark
