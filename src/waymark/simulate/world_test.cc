// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/world.h"

#include <gtest/gtest.h>

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/simulate/motion.h"

namespace waymark {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;

std::uint64_t hash(const World& world) {
  std::uint64_t result = 1469598103934665603ull;
  for (const Texture& texture : world.textures) {
    const float step = static_cast<float>(texture.texel_m());
    for (int i = 0; i < 400; ++i) {
      const Vector2f at(static_cast<float>(i % 20) * 7.0f * step,
                        static_cast<float>(i / 20) * step);
      const float grey = texture.sample(at, {step, 0.0f}, {0.0f, step});
      result = (result ^ static_cast<std::uint64_t>(grey * 16.0f)) * 1099511628211ull;
    }
  }
  return result;
}

TEST(World, SameSeedSameWorld) {
  const auto first = make_world("room", 5);
  EXPECT_EQ(hash(*first), hash(*make_world("room", 5)));
  EXPECT_NE(hash(*first), hash(*make_world("room", 6)));
}

TEST(World, UnknownNamesAreRefused) {
  EXPECT_THROW(make_world("rooom", 1), InputError);
  EXPECT_THROW(make_motion("rooom", "loop", 1.0), InputError);
  EXPECT_THROW(make_motion("room", "lop", 1.0), InputError);
}

TEST(World, RoomsHaveNoGapsAndDoorsAreOpen) {
  const auto world = make_world("apartment", 1);
  Rng rng(3, 0);
  for (int i = 0; i < 20000; ++i) {
    const double x = rng.normal();
    const double y = rng.normal();
    const Vector3d direction(x, y, rng.normal());
    ASSERT_TRUE(world->intersect({2.0, 1.75, 1.5}, direction).has_value());
  }
  const auto through_door = world->intersect({2.0, 1.75, 1.5}, Vector3d::UnitX());
  ASSERT_TRUE(through_door.has_value());
  EXPECT_GT(through_door->hit.distance, 4.5);
}

TEST(World, TwinsLookAlike) {
  const auto world = make_world("twins", 1);
  Rng rng(4, 0);
  for (int i = 0; i < 300; ++i) {
    const double yaw = rng.uniform(0.1, 3.0);
    const Vector3d direction(std::cos(yaw), std::sin(yaw), rng.uniform(-0.4, 0.4));
    const auto one = world->intersect({2.25, 1.5, 1.5}, direction);
    const auto two = world->intersect({7.45, 1.5, 1.5}, direction);
    ASSERT_TRUE(one && two);
    EXPECT_NEAR(one->hit.distance, two->hit.distance, 1e-9);
    const Vector2f edge(0.01f, 0.0f);
    const auto grey = [&](const WorldHit& hit) {
      const Texture& texture = world->textures[world->surfaces[hit.surface].texture];
      return texture.sample(hit.hit.uv.cast<float>(), edge, {0.0f, 0.01f});
    };
    // Single precision addresses the two a little differently.
    EXPECT_NEAR(grey(*one), grey(*two), 5.0);
  }
}

TEST(Texture, CoarseFootprintsKeepTheMean) {
  Image image(64, 64);
  Rng rng(1, 0);
  double mean = 0.0;
  for (std::uint8_t& value : image.values) {
    value = static_cast<std::uint8_t>(rng.below(256));
    mean += value / 4096.0;
  }
  const Texture texture(image, 0.01, false);
  EXPECT_NEAR(texture.sample({0.32f, 0.32f}, {0.64f, 0.0f}, {0.0f, 0.64f}), mean, 3.0);
}

TEST(Texture, FineFootprintsInterpolateAndColumnsWrap) {
  Image image(4, 2);
  image.values = {0, 100, 200, 40, 0, 100, 200, 40};
  const Vector2f tiny_u(0.1f, 0.0f);
  const Vector2f tiny_v(0.0f, 0.1f);
  const Texture flat(image, 1.0, false);
  EXPECT_NEAR(flat.sample({1.0f, 1.0f}, tiny_u, tiny_v), 50.0, 1e-3);
  EXPECT_NEAR(flat.sample({1.75f, 1.0f}, tiny_u, tiny_v), 125.0, 1e-3);
  EXPECT_NEAR(flat.sample({0.0f, 1.0f}, tiny_u, tiny_v), 0.0, 1e-3);
  const Texture round(image, 1.0, true);
  EXPECT_NEAR(round.sample({0.0f, 1.0f}, tiny_u, tiny_v), 20.0, 1e-3);
  EXPECT_NEAR(round.sample({4.0f, 1.0f}, tiny_u, tiny_v), 20.0, 1e-3);
}

}  // namespace
}  // namespace waymark
