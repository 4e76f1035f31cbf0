// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "waymark/input/input.h"

namespace waymark {

/// Frames that are missing between two that follow each other.
struct InputGap {
  std::size_t index = 0;         ///< Of the frame before it, in the whole INPUT.
  std::int64_t start_ns = 0;     ///< Time of that frame.
  std::int64_t duration_ns = 0;  ///< To the next one.
};

/// Steps of more than one and a half times the middle one, in their order. times_ns: increasing.
std::vector<InputGap> find_gaps(const std::vector<std::int64_t>& times_ns);

/// What an input holds, for people: the lines of what was understood, then cameras, gaps, topics.
std::string format_input(const InputInfo& info);

/// The same as one JSON object, its keys as in docs/cli.md.
std::string format_input_json(const InputInfo& info);

}  // namespace waymark
