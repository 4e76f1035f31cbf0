// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/simulate/world.h"

namespace waymark {

/// The world "street": a road round a block of houses, with trees, lamps and parked cars.
World make_street(std::uint64_t seed);

}  // namespace waymark
