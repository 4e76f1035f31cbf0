// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/input/listing.h"

namespace waymark {

/// Parses calib.txt: rows "P0: 12 numbers", the 3x4 projection matrices of rectified cameras in the
/// frame of camera 0. Cameras come without a resolution. Throws InputError when one of the first
/// num_cameras is missing or malformed; name is what it calls the file.
CameraChain parse_kitti_calibration(std::string_view text,
                                    const std::string& name,
                                    std::size_t num_cameras);

/// Data set in the layout of KITTI odometry (Geiger et al. 2012): image_0/, for stereo image_1/,
/// times.txt. Calibration: calib.txt.
Listing list_kitti(const std::filesystem::path& folder, const InputOptions& options);

/// Whether the folder holds image_0/ with times.txt or calib.txt beside it.
bool is_kitti(const std::filesystem::path& folder);

}  // namespace waymark
