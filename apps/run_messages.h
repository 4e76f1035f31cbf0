// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "reporter.h"
#include "waymark/session/session.h"

namespace waymark {

/// Says what became of a run whose results are in a folder, and what to try where it did not go
/// well.
void report_results(Reporter& reporter,
                    const SessionResults& results,
                    const std::filesystem::path& out);

}  // namespace waymark
