// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace waymark {

/// The file of true poses that belongs to an input, if its layout has one and it is there:
/// mav0/state_groundtruth_estimate0/data.csv (EuRoC), mav0/mocap0/data.csv (TUM-VI),
/// groundtruth.txt (TUM), poses.txt or ../../poses/NN.txt of sequences/NN (KITTI). For an input
/// that is a file they are looked for beside it. read_trajectory() reads what is found.
std::optional<std::filesystem::path> find_groundtruth(const std::filesystem::path& input);

}  // namespace waymark
