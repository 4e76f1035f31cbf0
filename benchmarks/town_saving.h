// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace waymark {

/// Registers the steps that save and load maps of towns of so many keyframes.
void register_saving_steps(std::int64_t num_keyframes);

}  // namespace waymark
