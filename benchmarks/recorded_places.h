// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/image/features.h"

namespace waymark {

/// What a keyframe looked like, and where its camera truly was.
struct RecordedPlace {
  std::vector<Descriptor> descriptors;
  Rigid3 world_from_camera;
};

/// Every n-th frame of a sequence that has a true pose (camera 0, 1000 features). The folder holds
/// an input, camchain.yaml and groundtruth.txt. Throws InputError.
std::vector<RecordedPlace> read_places(const std::filesystem::path& folder, std::size_t every);

}  // namespace waymark
