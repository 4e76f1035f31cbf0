// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/mapfile/map_file.h"
#include "waymark/view/update.h"

namespace waymark {

/// What a viewer is told of a map without a session: its keyframes stand for the trajectory, and
/// its images give the landmarks their colours and are there to be seen.
ViewUpdate show_saved_map(const StoredMap& stored);

}  // namespace waymark
