// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/triangulation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "waymark/geometry/bearing.h"

namespace waymark {
namespace {

// Ratio of the smallest to the largest eigenvalue of an information matrix below which the point
// counts as undetermined: a relative standard deviation of 1e6 between its axes.
constexpr double kMinConditioning = 1e-12;

bool is_in_front(const PointSighting& sighting, const Eigen::Vector3d& point_in_world) {
  return sighting.bearing.dot(sighting.cam_from_world * point_in_world) > 0.0;
}

bool is_in_front_of_all(std::span<const PointSighting> sightings, const Eigen::Vector3d& point) {
  return std::all_of(sightings.begin(), sightings.end(), [&](const PointSighting& sighting) {
    return is_in_front(sighting, point);
  });
}

bool is_determined(const Eigen::Matrix3d& information) {
  if (!information.allFinite()) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[0] > kMinConditioning * solver.eigenvalues()[2];
}

// The normal equations of a point at a given estimate.
struct PointSystem {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double squared_error_px2 = 0.0;
};

PointSystem linearise(std::span<const PointSighting> sightings, const Eigen::Vector3d& point) {
  PointSystem system;
  for (const PointSighting& sighting : sightings) {
    const PointResidual residual = point_residual(sighting, point);
    system.information += residual.jacobian.transpose() * residual.jacobian;
    system.gradient += residual.jacobian.transpose() * residual.value_px;
    system.squared_error_px2 += residual.value_px.squaredNorm();
  }
  return system;
}

// Minimises the sum of weight * squared distance to each ray. Weights of one at first, then
// 1 / distance^2 of the previous solution turn distances into angles.
std::optional<Eigen::Vector3d> nearest_to_rays(std::span<const PointSighting> sightings) {
  std::optional<Eigen::Vector3d> point;
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d target = Eigen::Vector3d::Zero();
    for (const PointSighting& sighting : sightings) {
      const Rigid3 world_from_cam = sighting.cam_from_world.inverse();
      const Eigen::Vector3d ray = world_from_cam.rotation * sighting.bearing;
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
      const double weight = point ? 1.0 / (*point - world_from_cam.translation).squaredNorm() : 1.0;
      information += weight * across;
      target += weight * across * world_from_cam.translation;
    }
    if (!is_determined(information)) return std::nullopt;
    point = information.ldlt().solve(target);
  }
  return point;
}

bool has_parallax(std::span<const PointSighting> sightings, double min_parallax_rad) {
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    for (std::size_t j = i + 1; j < sightings.size(); ++j) {
      const Eigen::Vector3d ray_i =
          sightings[i].cam_from_world.rotation.conjugate() * sightings[i].bearing;
      const Eigen::Vector3d ray_j =
          sightings[j].cam_from_world.rotation.conjugate() * sightings[j].bearing;
      if (ray_i.cross(ray_j).norm() >= std::sin(min_parallax_rad)) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<Eigen::Vector3d> triangulate(const Eigen::Vector3d& bearing_a,
                                           const Eigen::Vector3d& bearing_b,
                                           const Rigid3& a_from_b,
                                           double min_parallax_rad) {
  // Both rays in frame a: the first from its origin, the second from t.
  const Eigen::Vector3d ray_b = a_from_b.rotation * bearing_b;
  const Eigen::Vector3d& t = a_from_b.translation;
  const double p = bearing_a.cross(ray_b).norm();
  const double q = bearing_a.cross(t).norm();
  const double r = ray_b.cross(t).norm();
  if (!(p > 0.0) || p < std::sin(min_parallax_rad) || !(q + r > 0.0)) return std::nullopt;

  // By the law of sines, the points on both rays at equal angular error.
  const Eigen::Vector3d along_a = r / p * bearing_a;
  const Eigen::Vector3d along_b = q / p * ray_b;
  // In front of both, if reversing a ray (or both) does not bring its end nearer to the other's.
  const double gap = (t + along_b - along_a).squaredNorm();
  if (gap >= (t + along_b + along_a).squaredNorm() ||
      gap >= (t - along_b - along_a).squaredNorm() ||
      gap >= (t - along_b + along_a).squaredNorm()) {
    return std::nullopt;
  }
  // Weighted by inverse distances, p / r and p / q.
  return (q * along_a + r * (t + along_b)) / (q + r);
}

double parallax_angle(const Eigen::Vector3d& bearing_a,
                      const Eigen::Vector3d& bearing_b,
                      const Rigid3& a_from_b) {
  return angle_between(bearing_a, a_from_b.rotation * bearing_b);
}

std::optional<Eigen::Vector3d> triangulate(std::span<const PointSighting> sightings,
                                           double min_parallax_rad) {
  if (sightings.size() < 2 || !has_parallax(sightings, min_parallax_rad)) return std::nullopt;
  const std::optional<Eigen::Vector3d> point = nearest_to_rays(sightings);
  if (!point || !is_in_front_of_all(sightings, *point)) return std::nullopt;
  return point;
}

PointResidual point_residual(const PointSighting& sighting, const Eigen::Vector3d& point_in_world) {
  const Eigen::Vector3d point_in_cam = sighting.cam_from_world * point_in_world;
  const double distance = point_in_cam.norm();
  const Eigen::Vector3d bearing = point_in_cam / distance;
  const Eigen::Matrix3d bearing_from_point =
      (Eigen::Matrix3d::Identity() - bearing * bearing.transpose()) / distance;
  return {
      sighting.pixel_from_bearing * (bearing - sighting.bearing),
      sighting.pixel_from_bearing * bearing_from_point * sighting.cam_from_world.rotation_matrix()};
}

std::optional<PointEstimate> refine_point(std::span<const PointSighting> sightings,
                                          const Eigen::Vector3d& initial_point_in_world) {
  constexpr int kMaxIterations = 20;
  Eigen::Vector3d point = initial_point_in_world;
  PointSystem system = linearise(sightings, point);
  double damping = 1e-4;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!is_determined(system.information)) return std::nullopt;
    // Marquardt's scaling keeps the step independent of the unit of length.
    Eigen::Matrix3d damped = system.information;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::Vector3d step = damped.ldlt().solve(-system.gradient);
    const PointSystem next = linearise(sightings, point + step);
    if (next.squared_error_px2 <= system.squared_error_px2) {
      const double gain = system.squared_error_px2 - next.squared_error_px2;
      point += step;
      system = next;
      damping *= 0.1;
      if (gain <= 1e-12 * system.squared_error_px2) break;
    } else {
      damping = std::max(1e-6, damping * 10.0);
      if (damping > 1e6) break;
    }
  }
  if (!is_determined(system.information) || !is_in_front_of_all(sightings, point)) {
    return std::nullopt;
  }
  return PointEstimate{point, system.information.inverse(), system.squared_error_px2};
}

}  // namespace waymark
