// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

namespace waymark {

/// Each option that names a path is told to one of these when it is added, so that protect_inputs()
/// knows all that a command reads and writes.

/// A file or folder that is read.
CLI::Option* reads(CLI::Option* option);
/// A file, or a folder as a whole, that is written.
CLI::Option* writes(CLI::Option* option);
/// A folder that results are written to, see is_result_name().
CLI::Option* writes_results(CLI::Option* option);

/// Throws InputError where a parsed command would write to what it reads, by whatever name, or to
/// one file twice; --map-out may be --map-in, in which it goes on. What is in a folder that is read
/// is read, except results of earlier runs and files that no recording is made of.
void protect_inputs(CLI::App& program);

}  // namespace waymark
