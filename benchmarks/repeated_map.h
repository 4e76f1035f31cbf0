// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include "waymark/map/map.h"

namespace waymark {

/// A large map from a small one: it again and again, as further sub-maps, until there are so many
/// keyframes.
/// \param looks_alike  whether the copies have its descriptors; else they have random ones, so that
///                     nothing is recognised there.
std::shared_ptr<const Map> repeat_map(const Map& map, std::size_t num_keyframes, bool looks_alike);

}  // namespace waymark
