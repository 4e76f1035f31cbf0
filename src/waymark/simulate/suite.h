// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "waymark/simulate/sequence.h"

namespace waymark {

/// A sequence for evaluation, and what it exercises.
struct SuiteEntry {
  SequenceSpec spec;
  std::string setup;  ///< "mono", "stereo" or "rgbd".
  std::string about;  ///< One line for reports.
};

/// Ten fixed sequences. They are a yardstick: they never change for the sake of a result.
std::vector<SuiteEntry> simulated_suite();

}  // namespace waymark
