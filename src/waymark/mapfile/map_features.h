// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "waymark/camera/rig.h"
#include "waymark/image/features.h"
#include "waymark/mapfile/map_record.h"

namespace waymark {

/// Reads the features of a keyframe that the rig made. Throws InputError for what cannot be.
std::shared_ptr<const Features> read_features(MapRecord& record, const Rig& rig);

}  // namespace waymark
