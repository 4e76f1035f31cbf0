// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/testing/points.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Angle of a pixel of a usual camera; landmark sizes are chosen for it.
constexpr double kUsualPixelRad = 0.0024;
/// Middle of the pyramid: 1.2^3.5.
constexpr double kMiddleScale = 1.893;

Vector3d random_direction(Rng& rng) {
  const double x = rng.normal();
  const double y = rng.normal();
  return Vector3d(x, y, rng.normal()).normalized();
}

PointLandmark random_landmark(const Vector3d& position,
                              const Vector3d& normal,
                              double distance_m,
                              Rng& rng) {
  PointLandmark landmark;
  landmark.position = position;
  landmark.normal = normal;
  const Vector3d direction = random_direction(rng);
  landmark.tangent = (direction - normal * normal.dot(direction)).normalized();
  for (std::uint64_t& word : landmark.descriptor) word = rng.next();
  landmark.size_m = kUsualPixelRad * kMiddleScale * distance_m * std::exp2(rng.uniform(-1.3, 1.3));
  landmark.response = rng.uniform();
  return landmark;
}

/// Index of the surface at a share of the total area, areas summed up.
std::size_t surface_at(const std::vector<double>& areas_to, double share) {
  const double area = share * areas_to.back();
  const auto after = std::upper_bound(areas_to.begin(), areas_to.end() - 1, area);
  return static_cast<std::size_t>(after - areas_to.begin());
}

}  // namespace

PointCloud scatter_on(std::shared_ptr<const World> world,
                      int count,
                      double distance_m,
                      std::uint64_t seed) {
  std::vector<double> areas_to;
  double total = 0.0;
  for (const Surface& surface : world->surfaces) {
    total += surface.size.prod();
    areas_to.push_back(total);
  }
  Rng rng(seed, 0);
  PointCloud cloud;
  while (static_cast<int>(cloud.landmarks.size()) < count) {
    const Surface& surface = world->surfaces[surface_at(areas_to, rng.uniform())];
    const double u = rng.uniform(0.0, surface.size.x());
    const Vector2d uv(u, rng.uniform(0.0, surface.size.y()));
    const Vector2d centre = 0.5 * surface.size;
    if (surface.kind == SurfaceKind::kDisc && (uv - centre).norm() > surface.radius) continue;
    cloud.landmarks.push_back(
        random_landmark(surface_point(surface, uv), surface_normal(surface, uv), distance_m, rng));
  }
  cloud.world = std::move(world);
  return cloud;
}

PointCloud scatter_in(
    const Vector3d& min, const Vector3d& max, int count, double distance_m, std::uint64_t seed) {
  Rng rng(seed, 0);
  PointCloud cloud;
  for (int i = 0; i < count; ++i) {
    const double x = rng.uniform(min.x(), max.x());
    const double y = rng.uniform(min.y(), max.y());
    const Vector3d position(x, y, rng.uniform(min.z(), max.z()));
    cloud.landmarks.push_back(random_landmark(position, Vector3d::Zero(), distance_m, rng));
  }
  return cloud;
}

}  // namespace waymark
