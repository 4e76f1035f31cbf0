// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "waymark/evaluate/evaluation.h"
#include "waymark/input/input.h"
#include "waymark/session/session.h"

namespace waymark {

/// Folder of a recorded sequence below WAYMARK_DATA; nothing where it is not there.
std::optional<std::filesystem::path> recorded_sequence(const std::string& name);

struct RecordedResults {
  SessionResults session;
  Evaluation evaluation;
};

/// Maps a recorded sequence (the first num_frames of it) and compares it with its groundtruth.txt:
/// Sim(3) in mono, else SE(3).
RecordedResults map_recorded(const std::filesystem::path& folder,
                             Setup setup,
                             Timing timing,
                             std::optional<std::size_t> num_frames = std::nullopt);

}  // namespace waymark
