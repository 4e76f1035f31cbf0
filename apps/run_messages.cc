// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "run_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "input_command.h"
#include "waymark/base/text.h"
#include "waymark/report/advice.h"
#include "waymark/session/quality.h"

namespace waymark {
namespace {

/// A line for all, and one for each that was left out.
void report_markers(Reporter& reporter, const MarkerSummary& markers) {
  const auto used = std::ranges::count(markers.markers, "used", &MarkerSummary::Entry::verdict);
  std::string line =
      fmt::format("{} found, {} used", count_of(markers.markers.size(), "marker"), used);
  if (markers.frame == "none") line += "; they do not tell the scale of the map";
  if (markers.frame == "scale") line += "; the map is in metres by them";
  if (markers.frame == "marker 0") line += "; the map is in metres, in the frame of marker 0";
  if (markers.frame == "surveyed") {
    line += fmt::format("; the map is where the surveyed ones are, these {:.3f} m off (rms)",
                        markers.survey_rms_m);
  }
  reporter.info(line);
  for (const MarkerSummary::Entry& entry : markers.markers) {
    if (!entry.fault.empty()) reporter.info(entry.fault);
  }
}

void report_imu(Reporter& reporter, const InertialReport& imu) {
  if (!imu.is_used) {
    reporter.warning(fmt::format("the inertial data is not used: {}", imu.reason));
    return;
  }
  constexpr double kDegrees = 180.0 / M_PI;
  reporter.info(fmt::format(
      "inertial data: {}level to {:.2g} degrees; clock {:+.1f} +- {:.2g} ms, mounting known to "
      "{:.2g} degrees",
      imu.metric_from ? fmt::format("metres known to {:.2g} %, ", 100.0 * imu.scale_sigma) : "",
      kDegrees * imu.gravity_sigma_rad,
      1e3 * imu.time_shift_s,
      1e3 * imu.time_shift_sigma_s,
      kDegrees * imu.rotation_sigma_rad));
}

}  // namespace

void report_results(Reporter& reporter,
                    const SessionResults& results,
                    const std::filesystem::path& out) {
  const RunSummary& summary = results.summary;
  const FrameCounts& counts = summary.counts;
  reporter.info(
      fmt::format("{} of {} frames have a pose ({} unreadable, {} dropped), lost {}; {}, {}, {}",
                  counts.tracked,
                  counts.frames,
                  counts.unreadable,
                  counts.dropped,
                  count_of(counts.lost_count, "time"),
                  count_of(summary.keyframes, "keyframe"),
                  count_of(summary.landmarks, "landmark"),
                  count_of(summary.submaps, "sub-map")));
  report_reasons(reporter, results.table, summary);
  if (summary.quality) reporter.info(describe(*summary.quality, summary.loops));
  if (summary.markers) report_markers(reporter, *summary.markers);
  if (summary.imu) report_imu(reporter, *summary.imu);
  if (!results.ego_mask.values.empty()) {
    reporter.info(
        fmt::format("{:.1f} % of the image moves along with the camera and has no features: {}",
                    100.0 * summary.moves_along.value_or(0.0),
                    (out / "view_mask.png").string()));
  }
  const double num_frames = static_cast<double>(std::max<std::size_t>(counts.frames, 1));
  // Frames overlap: each may take longer than there is from one to the next.
  reporter.info(fmt::format("{}: {:.1f} ms per frame, tracking one takes {:.1f} ms; results in {}",
                            format_duration(summary.wall_s),
                            1e3 * summary.wall_s / num_frames,
                            summary.tracking_ms.mean,
                            out.string()));
  report_advice(reporter, summary);
}

}  // namespace waymark
