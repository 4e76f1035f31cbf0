// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/simulate/world.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d random_vector(Rng& rng, double size) {
  const double x = rng.uniform(-size, size);
  const double y = rng.uniform(-size, size);
  return {x, y, rng.uniform(-size, size)};
}

std::vector<Surface> examples() {
  return {make_rectangle({1.0, -0.5, 2.0}, Vector3d::UnitY(), -Vector3d::UnitZ(), {1.5, 0.8}),
          make_disc({0.3, 0.2, 0.9}, Vector3d::UnitZ(), 0.4),
          make_cylinder({0.5, -0.2, 0.1}, 0.3, 1.2),
          make_sphere({-0.4, 0.6, 0.2}, 0.5)};
}

TEST(Surface, PointsOfAllSurfacesAreHitFromOutside) {
  Rng rng(1, 0);
  for (const Surface& surface : examples()) {
    for (int i = 0; i < 200; ++i) {
      const double u = rng.uniform(0.3, 0.7) * surface.size.x();
      const Vector2d uv(u, rng.uniform(0.3, 0.7) * surface.size.y());
      const Vector3d point = surface_point(surface, uv);
      const Vector3d normal = surface_normal(surface, uv);
      const Vector3d origin = point + 2.0 * (normal + 0.4 * random_vector(rng, 1.0));
      const auto hit = intersect(surface, origin, point - origin);
      ASSERT_TRUE(hit.has_value());
      EXPECT_NEAR(hit->distance, 1.0, 1e-9);
      EXPECT_NEAR((hit->uv - uv).norm(), 0.0, 1e-9);
      EXPECT_NEAR((hit->normal - normal).norm(), 0.0, 1e-9);
    }
  }
}

TEST(Surface, AreNotSeenFromInsideNorFromAway) {
  for (const Surface& surface : examples()) {
    const Vector2d middle = 0.5 * surface.size;
    const Vector3d point = surface_point(surface, middle);
    const Vector3d normal = surface_normal(surface, middle);
    EXPECT_FALSE(intersect(surface, point - 0.01 * normal, normal).has_value());
    EXPECT_FALSE(intersect(surface, point + 0.01 * normal, normal).has_value());
  }
}

TEST(Surface, UToTheRightAndVDownSeenFromOutside) {
  for (const Surface& surface : examples()) {
    const Vector2d uv = 0.4 * surface.size;
    const double step = 1e-6;
    const Vector3d point = surface_point(surface, uv);
    const Vector3d right = (surface_point(surface, uv + Vector2d(step, 0.0)) - point) / step;
    const Vector3d down = (surface_point(surface, uv + Vector2d(0.0, step)) - point) / step;
    EXPECT_NEAR((right.cross(down).normalized() + surface_normal(surface, uv)).norm(), 0.0, 1e-4);
  }
}

TEST(Surface, SphereMatchesItsEquation) {
  const Surface sphere = make_sphere({0.2, -0.1, 0.4}, 0.7);
  Rng rng(2, 0);
  int num_hits = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d origin = sphere.origin + 3.0 * random_vector(rng, 1.0).normalized();
    const Vector3d direction = sphere.origin + random_vector(rng, 0.9) - origin;
    const auto hit = intersect(sphere, origin, direction);
    const Vector3d axis = direction.normalized();
    const double miss = (sphere.origin - origin).cross(axis).norm();
    ASSERT_EQ(hit.has_value(), miss <= sphere.radius);
    if (!hit) continue;
    ++num_hits;
    const Vector3d point = origin + hit->distance * direction;
    EXPECT_NEAR((point - sphere.origin).norm(), sphere.radius, 1e-9);
    EXPECT_GT(hit->normal.dot(origin - point), 0.0);
  }
  EXPECT_GT(num_hits, 100);
}

}  // namespace
}  // namespace waymark
