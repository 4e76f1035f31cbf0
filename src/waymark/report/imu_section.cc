// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/imu_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "waymark/report/drawing.h"
#include "waymark/report/page.h"

namespace waymark {
namespace {

/// A longer time between states is a gap.
constexpr std::int64_t kGapNs = 1'000'000'000;

std::string figure_of(const RunFolder& run,
                      const std::string& title,
                      const std::function<double(const NavigationState&)>& value) {
  DrawnCurve curve{{}, {}, {}, "time [s]", title};
  const std::int64_t first_ns = run.inertial.front().timestamp_ns;
  std::int64_t last_ns = first_ns;
  for (const NavigationState& state : run.inertial) {
    curve.x.push_back(1e-9 * static_cast<double>(state.timestamp_ns - first_ns));
    curve.y.push_back(value(state));
    curve.starts_stroke.push_back(state.timestamp_ns - last_ns > kGapNs);
    last_ns = state.timestamp_ns;
  }
  return fmt::format(
      "<figure><figcaption>{}</figcaption>\n{}</figure>\n", title, draw_curve(curve));
}

std::string curves_of(const RunFolder& run) {
  if (run.inertial.empty()) return "<p>Lengths in metres were not told.</p>\n";
  constexpr double kDegrees = 180.0 / M_PI;
  const auto& figure = figure_of;
  return "<div class=\"side-by-side\">\n" +
         figure(run, "Speed [m/s]", [](const auto& state) { return state.velocity.norm(); }) +
         figure(run,
                "Bias of the gyroscope [degrees/s]",
                [](const auto& state) { return kDegrees * state.biases.gyroscope.norm(); }) +
         figure(run,
                "Bias of the accelerometer [m/s²]",
                [](const auto& state) { return state.biases.accelerometer.norm(); }) +
         "</div>\n";
}

}  // namespace

std::string imu_section(const RunFolder& run) {
  if (!run.summary.imu) return "";
  const InertialReport& imu = *run.summary.imu;
  if (!imu.is_used) {
    return section("Inertial data", fmt::format("<p>Not used: {}.</p>\n", escaped(imu.reason)));
  }
  constexpr double kDegrees = 180.0 / M_PI;
  const auto num_filled = std::ranges::count(
      run.table.frames, FrameState::kFilled, [](const FrameRecord& frame) { return frame.state; });
  const std::string table = table_of(
      {},
      {{"Metres",
        fmt::format("known to {:.2g} %{}",
                    100.0 * imu.scale_sigma,
                    imu.metric_from ? fmt::format(", from frame {} on", imu.metric_from->value)
                                    : std::string())},
       {"Level", fmt::format("known to {:.2g} degrees", kDegrees * imu.gravity_sigma_rad)},
       {"Filled", fmt::format("{} frames, by it or by frames beside them", num_filled)},
       {"Clock",
        fmt::format(
            "{:.2f} &plusmn; {:.2f} ms", 1e3 * imu.time_shift_s, 1e3 * imu.time_shift_sigma_s)},
       {"Mounting",
        fmt::format("known to {:.2g} degrees and {:.2g} mm",
                    kDegrees * imu.rotation_sigma_rad,
                    1e3 * imu.lever_arm_sigma_m)}});
  return section("Inertial data", table + curves_of(run));
}

}  // namespace waymark
