// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "waymark/results/results.h"

namespace waymark {

/// What happened over time, as HTML: states and events as strips, below them the figures of the
/// frames. Of more than a few hundred frames several share a column, which shows the worst of
/// them. Ends with the same as JSON (id "timeline-data"), which the page's script reads out.
std::string draw_timelines(const FrameTable& table, const RunSummary& summary);

}  // namespace waymark
