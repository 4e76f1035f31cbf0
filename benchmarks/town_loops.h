// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace waymark {

/// Registers the steps that tell false loops from true ones, in towns of so many keyframes.
void register_loop_steps(std::int64_t num_keyframes);

}  // namespace waymark
