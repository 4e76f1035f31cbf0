// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/simulate/world.h"

namespace waymark {

/// The worlds of make_world(), see there.
World make_room(std::uint64_t seed);
World make_bare_room(std::uint64_t seed);
World make_apartment(std::uint64_t seed);
World make_twins(std::uint64_t seed);
World make_hall(std::uint64_t seed);
World make_street(std::uint64_t seed);

}  // namespace waymark
