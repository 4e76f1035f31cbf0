// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/absolute_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "waymark/geometry/bearing.h"
#include "waymark/geometry/polynomial.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/robust_loss.h"

namespace waymark {
namespace {

// Sine of the angle at a corner of the triangle of points below which they lie on a line.
constexpr double kMinSine = 1e-7;
// Squared lengths of the sides, relative to their sum, must come out right to this.
constexpr double kMaxSideError = 1e-9;

// The law of cosines for the three pairs of points: with the distances d along the bearings,
// d^T M_k d = a_k, where a_k is the squared length of side k, opposite of corner k.
struct Triangle {
  Eigen::Vector3d cosines;        // of the angle between the two other bearings
  Eigen::Vector3d squared_sides;  // scaled to sum to one

  Eigen::Matrix3d quadric(int k) const {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
    result(i, i) = result(j, j) = 1.0;
    result(i, j) = result(j, i) = -cosines[k];
    return result;
  }

  // d^T M_k d - a_k.
  Eigen::Vector3d side_errors(const Eigen::Vector3d& d) const {
    Eigen::Vector3d errors;
    for (int k = 0; k < 3; ++k) {
      const double u = d[(k + 1) % 3], v = d[(k + 2) % 3];
      errors[k] = u * u + v * v - 2.0 * cosines[k] * u * v - squared_sides[k];
    }
    return errors;
  }
};

Eigen::Matrix3d adjugate(const Eigen::Matrix3d& symmetric) {
  Eigen::Matrix3d result;
  for (int i = 0; i < 3; ++i) {
    result.row(i) = symmetric.col((i + 1) % 3).cross(symmetric.col((i + 2) % 3)).transpose();
  }
  return result;
}

// Normals of the two planes that a quadric of rank 2 consists of, not normalised. The product of
// its two eigenvalues is the trace of the adjugate, which must be negative for the planes to be
// real.
std::array<Eigen::Vector3d, 2> split(const Eigen::Matrix3d& quadric) {
  const Eigen::Matrix3d adjoint = adjugate(quadric);
  int k = 0;
  adjoint.diagonal().cwiseAbs().maxCoeff(&k);
  const double negative = std::max(-adjoint(k, k), 0.0);
  // The line that the planes share, of the length at which the sum has rank 1.
  const Eigen::Vector3d shared = negative > 0.0
                                     ? Eigen::Vector3d(adjoint.col(k) / std::sqrt(negative))
                                     : Eigen::Vector3d(Eigen::Vector3d::Zero());
  const Eigen::Matrix3d product = quadric + skew(shared);
  int row = 0, column = 0;
  product.cwiseAbs().maxCoeff(&row, &column);
  return {Eigen::Vector3d(product.row(row)), Eigen::Vector3d(product.col(column))};
}

struct Pencil {
  Eigen::Matrix3d degenerate;  // The member of rank 2 with the best separated planes.
  Eigen::Matrix3d other;       // One that is independent of it.
};

// All members of the pencil d1 + gamma d2 vanish for the true distances.
Pencil find_pencil(const Eigen::Matrix3d& d1, const Eigen::Matrix3d& d2) {
  const Eigen::Matrix3d adjugate1 = adjugate(d1), adjugate2 = adjugate(d2);
  // det(d1 + gamma d2), ascending.
  const std::array<double, 4> cubic = {d1.determinant(),
                                       adjugate1.cwiseProduct(d2).sum(),
                                       adjugate2.cwiseProduct(d1).sum(),
                                       d2.determinant()};
  Pencil best{d2, d1};  // gamma at infinity
  double best_separation = 0.0;
  for (const double gamma : real_roots(cubic)) {
    const bool is_large = std::abs(gamma) > 1.0;
    const Eigen::Matrix3d member = is_large ? Eigen::Matrix3d(d1 / gamma + d2) : d1 + gamma * d2;
    const double separation = -adjugate(member).trace() / member.squaredNorm();
    if (!(separation > best_separation)) continue;
    best_separation = separation;
    best = {member, is_large ? d1 : d2};
  }
  return best;
}

// Newton's method on the sides; the scale of d is right already.
std::optional<Eigen::Vector3d> polish(const Triangle& triangle, Eigen::Vector3d d) {
  constexpr int kNumIterations = 3;
  Eigen::Vector3d errors = triangle.side_errors(d);
  for (int iteration = 0; iteration < kNumIterations; ++iteration) {
    Eigen::Matrix3d by_d;
    for (int k = 0; k < 3; ++k) by_d.row(k) = 2.0 * triangle.quadric(k) * d;
    const Eigen::Vector3d next = d - by_d.partialPivLu().solve(errors);
    const Eigen::Vector3d next_errors = triangle.side_errors(next);
    if (!(next_errors.squaredNorm() < errors.squaredNorm())) break;
    d = next;
    errors = next_errors;
  }
  const bool is_solution = d.minCoeff() > 0.0 && errors.cwiseAbs().maxCoeff() < kMaxSideError;
  return is_solution ? std::optional(d) : std::nullopt;
}

// The distances in a plane through the origin that satisfy the homogeneous quadric.
void append_distances(const Eigen::Vector3d& normal,
                      const Eigen::Matrix3d& quadric,
                      const Triangle& triangle,
                      std::vector<Eigen::Vector3d>& distances) {
  if (!(normal.squaredNorm() > 0.0)) return;
  const Eigen::Matrix<double, 3, 2> basis = tangent_basis(normal.normalized());
  const Eigen::Matrix2d form = basis.transpose() * quadric * basis;
  const double discriminant = form(0, 1) * form(0, 1) - form(0, 0) * form(1, 1);
  // Where two solutions are about to merge, rounding must not lose both.
  if (!(discriminant > -1e-10 * form.squaredNorm())) return;
  const double root = std::sqrt(std::max(discriminant, 0.0));
  const double t = -(form(0, 1) + std::copysign(root, form(0, 1)));
  const Eigen::Matrix3d all_sides = triangle.quadric(0) + triangle.quadric(1) + triangle.quadric(2);
  for (const Eigen::Vector2d& ray :
       {Eigen::Vector2d(t, form(0, 0)), Eigen::Vector2d(form(1, 1), t)}) {
    Eigen::Vector3d d = basis * ray;
    if (d.sum() < 0.0) d = -d;
    const double sum_of_sides = d.dot(all_sides * d);
    if (!(d.minCoeff() > 0.0) || !(sum_of_sides > 0.0)) continue;
    const auto polished = polish(triangle, d / std::sqrt(sum_of_sides));
    if (polished) distances.push_back(*polished);
  }
}

// Axes along the first side, across it in the plane of the triangle, and normal to that.
Eigen::Matrix3d triangle_axes(std::span<const Eigen::Vector3d, 3> corners) {
  const Eigen::Vector3d side = (corners[1] - corners[0]).normalized();
  const Eigen::Vector3d normal = side.cross(corners[2] - corners[0]).normalized();
  Eigen::Matrix3d axes;
  axes << side, normal.cross(side), normal;
  return axes;
}

bool is_triangle(std::span<const Eigen::Vector3d, 3> corners) {
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d u = corners[(k + 1) % 3] - corners[k];
    const Eigen::Vector3d v = corners[(k + 2) % 3] - corners[k];
    const double lengths = u.norm() * v.norm();
    if (!(u.cross(v).norm() > kMinSine * lengths) || !std::isfinite(lengths)) return false;
  }
  return true;
}

struct PoseSystem {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

PoseSystem linearise(const Rigid3& cam_from_world,
                     const PointObservations& observations,
                     std::span<const std::uint32_t> indices,
                     double squared_scale) {
  PoseSystem system;
  for (const std::uint32_t index : indices) {
    const Eigen::Vector3d point = cam_from_world * observations.points_in_world[index];
    const Eigen::Vector3d& bearing = observations.bearings[index];
    const double range = point.norm();
    const Eigen::Vector3d direction = point / range;
    if (!(direction.dot(bearing) > 0.0)) continue;
    const double inverse_sigma = 1.0 / observations.sigmas_rad[index];
    const Eigen::Matrix<double, 2, 3> tangent = inverse_sigma * tangent_basis(bearing).transpose();
    const Eigen::Vector2d residual = tangent * direction;
    Eigen::Matrix<double, 2, 6> jacobian;
    jacobian.leftCols<3>() = (tangent - tangent * direction * direction.transpose()) / range;
    jacobian.rightCols<3>() = -jacobian.leftCols<3>() * skew(point);
    const double weight = geman_mcclure_weight(
        (direction - bearing).squaredNorm() * inverse_sigma * inverse_sigma, squared_scale);
    system.information += weight * jacobian.transpose() * jacobian;
    system.gradient += weight * jacobian.transpose() * residual;
  }
  return system;
}

}  // namespace

std::vector<Rigid3> solve_absolute_three_point(
    std::span<const Eigen::Vector3d, 3> bearings,
    std::span<const Eigen::Vector3d, 3> points_in_world) {
  if (!is_triangle(points_in_world)) return {};
  Triangle triangle;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    triangle.cosines[k] = bearings[i].dot(bearings[j]);
    triangle.squared_sides[k] = (points_in_world[i] - points_in_world[j]).squaredNorm();
  }
  if (!triangle.cosines.allFinite()) return {};
  const double size = std::sqrt(triangle.squared_sides.sum());
  triangle.squared_sides /= size * size;
  const Eigen::Vector3d& a = triangle.squared_sides;
  const Pencil pencil = find_pencil(a[0] * triangle.quadric(2) - a[2] * triangle.quadric(0),
                                    a[0] * triangle.quadric(1) - a[1] * triangle.quadric(0));
  std::vector<Eigen::Vector3d> distances;
  for (const Eigen::Vector3d& normal : split(pencil.degenerate)) {
    append_distances(normal, pencil.other, triangle, distances);
  }
  const Eigen::Matrix3d axes_in_world = triangle_axes(points_in_world);
  const Eigen::Vector3d centre_in_world =
      (points_in_world[0] + points_in_world[1] + points_in_world[2]) / 3.0;
  std::vector<Rigid3> poses;
  for (const Eigen::Vector3d& d : distances) {
    std::array<Eigen::Vector3d, 3> points_in_cam;
    for (int k = 0; k < 3; ++k) points_in_cam[k] = size * d[k] * bearings[k];
    const Eigen::Quaterniond rotation(triangle_axes(points_in_cam) * axes_in_world.transpose());
    const Eigen::Vector3d centre_in_cam =
        (points_in_cam[0] + points_in_cam[1] + points_in_cam[2]) / 3.0;
    const Rigid3 pose(rotation.normalized(), centre_in_cam - rotation * centre_in_world);
    if (pose.translation.allFinite()) poses.push_back(pose);
  }
  return poses;
}

std::vector<Rigid3> AbsolutePoseEstimator::fit(
    std::span<const std::uint32_t, kSampleSize> sample) const {
  std::array<Eigen::Vector3d, kSampleSize> bearings, points_in_world;
  for (std::size_t i = 0; i < kSampleSize; ++i) {
    bearings[i] = observations_.bearings[sample[i]];
    points_in_world[i] = observations_.points_in_world[sample[i]];
  }
  return solve_absolute_three_point(bearings, points_in_world);
}

double AbsolutePoseEstimator::squared_error(const Rigid3& cam_from_world, std::size_t index) const {
  const Eigen::Vector3d direction =
      (cam_from_world * observations_.points_in_world[index]).normalized();
  const double sigma = observations_.sigmas_rad[index];
  return (direction - observations_.bearings[index]).squaredNorm() / (sigma * sigma);
}

std::optional<Rigid3> AbsolutePoseEstimator::refine(const Rigid3& cam_from_world,
                                                    std::span<const std::uint32_t> nearby) const {
  constexpr int kNumSteps = 3;
  if (nearby.size() <= kSampleSize) return std::nullopt;
  Rigid3 pose = cam_from_world;
  for (int step = 0; step < kNumSteps; ++step) {
    const PoseSystem system = linearise(pose, observations_, nearby, kMaxSquaredError);
    const Vector6d tangent = -system.information.ldlt().solve(system.gradient);
    if (!tangent.allFinite()) return std::nullopt;
    pose = Rigid3::exp(tangent) * pose;
  }
  return pose;
}

}  // namespace waymark
