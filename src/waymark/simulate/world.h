// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/simulate/surface.h"
#include "waymark/simulate/texture.h"

namespace waymark {

/// Where a ray meets the world.
struct WorldHit {
  std::uint32_t surface = 0;  ///< Index in World::surfaces.
  SurfaceHit hit;             ///< Where on it.
};

/// Textured analytic surfaces; z points up, the ground is near z = 0. Immutable once made.
struct World {
  std::string name;               ///< As make_world() knows it.
  std::vector<Surface> surfaces;  ///< In no order.
  std::vector<Texture> textures;  ///< That surfaces refer to by index.

  /// The nearest surface along origin + t * direction, t > 0; nothing where there is only sky.
  std::optional<WorldHit> intersect(const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction) const;
};

/// Names that make_world() knows:
///   room       one furnished room, 6 x 5 m
///   apartment  four rooms of 4 x 3.5 m in a ring of doors
///   hall       24 x 16 x 7 m with columns and crates
///   street     a block of houses to drive around, 40 x 28 m
///   twins      two rooms that look exactly alike, with a corridor that does not
///   bare       the room with hardly any texture on its walls
std::vector<std::string> world_names();

/// Makes a named world; the same name and seed give the same world. Throws InputError for an
/// unknown name.
std::shared_ptr<const World> make_world(std::string_view name, std::uint64_t seed);

}  // namespace waymark
