// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/timeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "waymark/evaluate/chart.h"
#include "waymark/report/drawing.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxColumns = 600;
constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
/// Above this part of the largest values a track ends: single ones would flatten the rest.
constexpr double kShownPart = 0.995;

/// What of several frames is to be seen first.
int severity(FrameState state) {
  switch (state) {
    case FrameState::kLost:
      return 5;
    case FrameState::kUnreadable:
      return 4;
    case FrameState::kDropped:
      return 3;
    case FrameState::kInitializing:
      return 2;
    case FrameState::kFilled:
      return 1;
    case FrameState::kTracked:
      return 0;
  }
  return 0;
}

/// Frames that share a column.
using TimelineColumn = std::span<const FrameRecord>;

std::vector<TimelineColumn> columns_of(std::span<const FrameRecord> frames) {
  const std::size_t step = (frames.size() + kMaxColumns - 1) / kMaxColumns;
  std::vector<TimelineColumn> columns;
  for (std::size_t begin = 0; begin < frames.size(); begin += step) {
    columns.push_back(frames.subspan(begin, std::min(step, frames.size() - begin)));
  }
  return columns;
}

const FrameRecord& worst_of(const TimelineColumn& column) {
  return *std::ranges::max_element(
      column, {}, [](const FrameRecord& frame) { return severity(frame.state); });
}

/// NaN: the frame has no such figure.
using FrameFigure = std::function<double(const FrameRecord&)>;

/// Of each column the least or the largest.
TimelineValues extremes(const std::vector<TimelineColumn>& columns,
                        const FrameFigure& figure,
                        bool is_least) {
  TimelineValues values;
  for (const TimelineColumn& column : columns) {
    double extreme = kNoValue;
    for (const FrameRecord& frame : column) {
      const double value = figure(frame);
      if (std::isnan(value)) continue;
      const bool is_new = std::isnan(extreme) || (is_least ? value < extreme : value > extreme);
      if (is_new) extreme = value;
    }
    values.push_back(extreme);
  }
  return values;
}

/// Of what is shown; 0 where there is nothing.
double top_of(const TimelineValues& values) {
  std::vector<double> known;
  std::ranges::copy_if(
      values, std::back_inserter(known), [](double value) { return std::isfinite(value); });
  if (known.empty()) return 0.0;
  std::ranges::sort(known);
  return known[static_cast<std::size_t>(kShownPart * static_cast<double>(known.size() - 1))];
}

bool has_any(const TimelineValues& values) {
  return std::ranges::any_of(values, [](double value) { return std::isfinite(value); });
}

double inliers_of(const FrameRecord& frame) {
  return frame.state == FrameState::kTracked ? frame.num_inliers : kNoValue;
}
double matches_of(const FrameRecord& frame) {
  return frame.state == FrameState::kTracked ? frame.num_matches : kNoValue;
}
double features_of(const FrameRecord& frame) {
  return frame.num_features ? *frame.num_features : kNoValue;
}
double brightness_of(const FrameRecord& frame) {
  return frame.picture.is_known ? frame.picture.brightness : kNoValue;
}
double contrast_of(const FrameRecord& frame) {
  return frame.picture.is_known ? frame.picture.contrast : kNoValue;
}
double blur_of(const FrameRecord& frame) {
  return frame.picture.is_known ? frame.picture.blur_percent : kNoValue;
}

/// Of the columns of times all but the waiting.
FrameFigure time_figure(const FrameTable& table) {
  return [&stages = table.stages](const FrameRecord& frame) {
    if (frame.num_stages == 0) return kNoValue;
    double sum_ms = 0.0;
    for (std::size_t i = 0; i < frame.num_stages; ++i) {
      if (stages[i] != "wait") sum_ms += static_cast<double>(frame.stage_ms[i]);
    }
    return sum_ms;
  };
}

/// A figure with its name, its unit and where it ends.
std::string track(const std::string& name,
                  std::span<const TimelineLine> lines,
                  double top,
                  std::string_view unit) {
  if (!has_any(lines.front().values)) return "";
  const double shown = std::max(top, 1e-3);
  return fmt::format(
      "<figure class=\"line\"><figcaption>{}<span>0 to {:.4g}{}</span></figcaption>\n{}</figure>\n",
      name,
      shown,
      unit,
      draw_timeline(lines, shown, name + " over time"));
}

std::string state_strip(const std::vector<TimelineColumn>& columns) {
  std::vector<std::string> styles;
  for (const TimelineColumn& column : columns) {
    styles.push_back("s-" + std::string(to_string(worst_of(column).state)));
  }
  std::string legend;
  for (const FrameState state : {FrameState::kTracked,
                                 FrameState::kFilled,
                                 FrameState::kInitializing,
                                 FrameState::kLost,
                                 FrameState::kUnreadable,
                                 FrameState::kDropped}) {
    const std::string style = "s-" + std::string(to_string(state));
    if (std::ranges::find(styles, style) == styles.end()) continue;
    legend +=
        fmt::format("<span class=\"key\"><i class=\"{}\"></i>{}</span> ", style, to_string(state));
  }
  return fmt::format("<figure><figcaption>State<span>{}</span></figcaption>\n{}</figure>\n",
                     legend,
                     draw_strip(styles, "State of the frames over time"));
}

/// Loops end at a frame; the frame that they go back to is not marked.
std::string event_strip(const std::vector<TimelineColumn>& columns, const RunSummary& summary) {
  std::vector<std::uint32_t> closed;
  for (const LoopFrames& loop : summary.loop_frames) {
    if (loop.to) closed.push_back(*loop.to);
  }
  std::ranges::sort(closed);
  std::vector<std::string> styles;
  bool has_loop = false, is_found_again = false;
  for (const TimelineColumn& column : columns) {
    const auto first = std::ranges::lower_bound(closed, column.front().index);
    const bool is_loop = first != closed.end() && *first <= column.back().index;
    const bool is_again = std::ranges::any_of(column, &FrameRecord::is_relocalized);
    has_loop = has_loop || is_loop;
    is_found_again = is_found_again || is_again;
    styles.push_back(is_loop ? "e-loop" : is_again ? "e-again" : "");
  }
  if (!has_loop && !is_found_again) return "";
  std::string legend;
  if (has_loop)
    legend += "<span class=\"key\"><i class=\"e-loop\"></i>place seen again (loop)</span> ";
  if (is_found_again)
    legend += "<span class=\"key\"><i class=\"e-again\"></i>found again after a loss</span>";
  return fmt::format("<figure><figcaption>Events<span>{}</span></figcaption>\n{}</figure>\n",
                     legend,
                     draw_strip(styles, "Loops and relocalisations over time"));
}

double seconds_since(std::int64_t start_ns, std::int64_t time_ns) {
  return 1e-9 * (static_cast<double>(time_ns) - static_cast<double>(start_ns));
}

/// For the script; '<' cannot end the element that holds it.
std::string data_of(const std::vector<TimelineColumn>& columns, const FrameFigure& time_ms) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  const auto value_of = [](double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(std::round(10.0 * value) / 10.0)
                                : nlohmann::ordered_json(nullptr);
  };
  const std::int64_t start_ns = columns.front().front().timestamp_ns;
  for (const TimelineColumn& column : columns) {
    const FrameRecord& frame = worst_of(column);
    list.push_back({frame.index,
                    std::round(1e3 * seconds_since(start_ns, frame.timestamp_ns)) / 1e3,
                    to_string(frame.state),
                    frame.reason == FrameReason::kNone ? "" : to_string(frame.reason),
                    value_of(inliers_of(frame)),
                    value_of(features_of(frame)),
                    value_of(brightness_of(frame)),
                    value_of(contrast_of(frame)),
                    value_of(blur_of(frame)),
                    value_of(time_ms(frame))});
  }
  return fmt::format("<script type=\"application/json\" id=\"timeline-data\">{}</script>\n",
                     list.dump());
}

}  // namespace

std::string draw_timelines(const FrameTable& table, const RunSummary& summary) {
  if (table.frames.empty()) return "<p>There were no frames.</p>\n";
  const std::vector<TimelineColumn> columns = columns_of(table.frames);
  const FrameFigure time_ms = time_figure(table);
  const auto least = [&columns](const FrameFigure& figure) {
    return extremes(columns, figure, true);
  };
  const auto largest = [&columns](const FrameFigure& figure) {
    return extremes(columns, figure, false);
  };
  const TimelineValues matches = largest(matches_of);
  const TimelineLine inliers[] = {{least(inliers_of), "l-main"}, {matches, "l-faint"}};
  const TimelineLine features[] = {{least(features_of), "l-main"}};
  const TimelineLine light[] = {{least(brightness_of), "l-main"}, {least(contrast_of), "l-second"}};
  const TimelineLine blur[] = {{largest(blur_of), "l-main"}};
  const TimelineLine times[] = {{largest(time_ms), "l-main"}};
  std::string html = "<div class=\"timeline\" id=\"timeline\">\n";
  html += state_strip(columns) + event_strip(columns, summary);
  html += track("Inliers (and matches, faint)", inliers, std::max(top_of(matches), 1.0), "");
  html += track("Features", features, 1.05 * top_of(features[0].values), "");
  html += track("Brightness (and contrast, green)", light, 255.0, " grey values");
  html += track("Blur", blur, 100.0, " %");
  html += track("Tracking time", times, top_of(times[0].values), " ms");
  const double end_s =
      seconds_since(table.frames.front().timestamp_ns, table.frames.back().timestamp_ns);
  html += fmt::format(
      "<div class=\"axis-x\"><span>0 s</span><span>{:.1f} s</span><span>{:.1f} s</span></div>\n",
      0.5 * end_s,
      end_s);
  html += "<div id=\"cursor\" hidden></div>\n</div>\n";
  html +=
      "<p id=\"readout\" class=\"note\" aria-live=\"polite\">Point at the timeline to read a "
      "frame.</p>\n";
  if (table.frames.size() > columns.size()) {
    html += fmt::format(
        "<p class=\"note\">{} frames share a column, which shows the worst of them.</p>\n",
        columns.front().size());
  }
  return html + data_of(columns, time_ms);
}

}  // namespace waymark
