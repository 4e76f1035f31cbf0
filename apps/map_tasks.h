// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "commands.h"

namespace waymark {

/// What `map` can do that changes maps. Each adds one subcommand, as add_map_command() does.
void add_merge_task(CLI::App& maps, Command& command);
void add_align_task(CLI::App& maps, Command& command);

}  // namespace waymark
