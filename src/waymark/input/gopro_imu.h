// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/input/imu_stream.h"
#include "waymark/input/video_file.h"

namespace waymark {

/// The IMU of a GoPro camera, of the packets of a file's telemetry (GPMF); nothing where they have
/// none. Axes are those of the camera held upright: x right, y down, z forward. Times are those of
/// the file, which begins with its first image. Throws InputError at `source` for axes that make no
/// frame.
std::optional<ImuStream> imu_of_gopro(std::span<const TelemetryPacket> packets,
                                      const std::string& source);

/// The same of the files of a video, which follow each other; nothing where one has none. Throws
/// InputError.
std::optional<ImuStream> imu_of_videos(const std::vector<std::filesystem::path>& files);

}  // namespace waymark
