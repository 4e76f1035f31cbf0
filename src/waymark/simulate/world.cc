// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/world.h"

#include <array>

#include "waymark/base/check.h"
#include "waymark/simulate/named_worlds.h"

namespace waymark {
namespace {

struct NamedWorld {
  std::string_view name;
  World (*make)(std::uint64_t seed);
};

constexpr std::array<NamedWorld, 6> kWorlds = {{{"room", make_room},
                                                {"apartment", make_apartment},
                                                {"hall", make_hall},
                                                {"street", make_street},
                                                {"twins", make_twins},
                                                {"bare", make_bare_room}}};

}  // namespace

std::optional<WorldHit> World::intersect(const Eigen::Vector3d& origin,
                                         const Eigen::Vector3d& direction) const {
  std::optional<WorldHit> nearest;
  for (std::uint32_t i = 0; i < surfaces.size(); ++i) {
    const std::optional<SurfaceHit> hit = waymark::intersect(surfaces[i], origin, direction);
    if (hit && (!nearest || hit->distance < nearest->hit.distance)) nearest = WorldHit{i, *hit};
  }
  return nearest;
}

std::vector<std::string> world_names() {
  std::vector<std::string> names;
  for (const NamedWorld& world : kWorlds) names.emplace_back(world.name);
  return names;
}

std::shared_ptr<const World> make_world(std::string_view name, std::uint64_t seed) {
  std::string known;
  for (const NamedWorld& world : kWorlds) {
    if (world.name == name) return std::make_shared<const World>(world.make(seed));
    known += (known.empty() ? "" : ", ") + std::string(world.name);
  }
  throw InputError("world '" + std::string(name) + "'", "unknown, expected one of " + known);
}

}  // namespace waymark
