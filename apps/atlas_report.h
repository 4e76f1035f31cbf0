// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/atlas/atlas.h"

namespace waymark {

/// A page on an atlas: what it holds of which recording, and each of its parts from above and from
/// the side. Opens one tile after the other.
std::string format_atlas_report(const Atlas& atlas);

}  // namespace waymark
