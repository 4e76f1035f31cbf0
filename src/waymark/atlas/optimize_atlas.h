// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// All tiles of an atlas are adjusted to each other.
//
//   Atlas atlas = Atlas::open("building.atlas");
//   optimize_atlas(atlas, [](const std::string& step) { std::cout << step << "\n"; });

#include <cstddef>
#include <functional>
#include <string>

#include "waymark/atlas/atlas.h"

namespace waymark {

/// What optimizing did.
struct OptimizedAtlas {
  std::size_t num_adjusted = 0;  ///< Tiles.
};

/// Solves the anchors, adjusts each tile with its neighbours held, and solves the anchors again by
/// where the landmarks went. say: hears of each step.
OptimizedAtlas optimize_atlas(Atlas& atlas,
                              const std::function<void(const std::string&)>& say = {});

}  // namespace waymark
