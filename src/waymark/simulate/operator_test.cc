// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/operator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

constexpr double kCarriedS = 20.0;
constexpr double kRadPerDegree = std::numbers::pi / 180.0;

class Operator : public ::testing::Test {
 protected:
  Operator() { add_operator(motion_, 7, world_); }

  World world_at(double time_s) const {
    World world;
    world.surfaces = world_.surfaces_at(time_s);
    return world;
  }

  /// Directions so many degrees from straight down.
  static std::vector<Vector3d> cone(double deg) {
    std::vector<Vector3d> directions;
    for (double around = 0.0; around < 360.0; around += 10.0) {
      const double a = around * kRadPerDegree;
      directions.emplace_back(std::sin(deg * kRadPerDegree) * std::cos(a),
                              std::sin(deg * kRadPerDegree) * std::sin(a),
                              -std::cos(deg * kRadPerDegree));
    }
    return directions;
  }

  bool shows_operator(const World& world, const Vector3d& eye, const Vector3d& direction) const {
    const std::optional<WorldHit> hit = world.intersect(eye, direction);
    return hit && hit->surface >= num_surfaces_;
  }

  Motion motion_ = make_motion("apartment", "loop", kCarriedS);
  World world_ = *make_world("apartment", 1);
  std::size_t num_surfaces_ = world_.surfaces.size();
};

TEST_F(Operator, FillsTheViewDownwardsAndNoMore) {
  for (double t = 0.0; t < kCarriedS; t += 1.0) {
    const World world = world_at(t);
    const Vector3d eye = motion_.world_from_rig(t).translation;
    int num_seen = 0;
    for (const Vector3d& direction : cone(10.0)) num_seen += shows_operator(world, eye, direction);
    EXPECT_GE(num_seen, 34) << t;
    for (const double deg : {40.0, 60.0, 90.0, 150.0}) {
      for (const Vector3d& direction : cone(deg)) {
        EXPECT_FALSE(shows_operator(world, eye, direction)) << t << " " << deg;
      }
    }
  }
}

TEST_F(Operator, HoldsThePoleStillBeforeTheCameraAndSwaysBelowIt) {
  ASSERT_EQ(world_.carried.size(), 2u);
  std::vector<Vector3d> pole_in_rig;
  std::vector<Vector3d> head_in_rig;
  for (double t = 0.0; t < kCarriedS; t += 0.25) {
    const std::vector<Surface> surfaces = world_.surfaces_at(t);
    const Rigid3 rig_from_world = motion_.world_from_rig(t).inverse();
    pole_in_rig.push_back(rig_from_world * surfaces[world_.carried[0].first_surface].origin);
    head_in_rig.push_back(rig_from_world * surfaces[world_.carried[1].first_surface].origin);
  }
  double most_m = 0.0;
  for (std::size_t i = 0; i < pole_in_rig.size(); ++i) {
    EXPECT_LT((pole_in_rig[i] - pole_in_rig[0]).norm(), 1e-9);
    most_m = std::max(most_m, (head_in_rig[i] - head_in_rig[0]).norm());
  }
  EXPECT_GT(most_m, 0.01);
  EXPECT_LT(most_m, 0.15);
}

TEST_F(Operator, IsInTheImagesOfASequenceThatHasOne) {
  SequenceSpec spec;
  spec.world = "apartment";
  spec.num_frames = 3;
  spec.chain = mono_chain(named_camera("equirectangular", 48));
  const Image without = SimulatedSequence(spec).frame(1).images[0];
  spec.has_operator = true;
  const Image with = SimulatedSequence(spec).frame(1).images[0];
  int num_changed = 0;
  for (int y = 0; y < with.height_px; ++y) {
    for (int x = 0; x < with.width_px; ++x) {
      const bool is_changed = with.row(y)[x] != without.row(y)[x];
      EXPECT_FALSE(is_changed && y < 34) << x << " " << y;
      num_changed += is_changed ? 1 : 0;
    }
  }
  EXPECT_GT(num_changed, 96 * 4);
}

TEST_F(Operator, KeepsShapesWhole) {
  for (const Surface& surface : world_.surfaces_at(3.0)) {
    EXPECT_NEAR(surface.u_axis.norm(), 1.0, 1e-9);
    EXPECT_NEAR(surface.v_axis.norm(), 1.0, 1e-9);
    EXPECT_NEAR(surface.u_axis.dot(surface.v_axis), 0.0, 1e-9);
  }
}

}  // namespace
}  // namespace waymark
