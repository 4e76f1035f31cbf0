// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/results/results.h"

namespace waymark {

/// What the recorded figures of a run say of its trouble. A frame is weak if it has no pose, or one
/// on hardly anything. Frames that were never looked at are none.
struct TroubleFigures {
  double num_frames = 0.0;     ///< That were looked at.
  double weak_part = 0.0;      ///< Of them.
  double poseless_part = 0.0;  ///< Of them.
  bool has_started = false;    ///< Whether any frame was tracked.
  // Medians over the weak frames.
  double brightness = 255.0;          ///< Grey values; as if bright where nothing is known.
  double contrast = 255.0;            ///< The same.
  double blur_percent = 0.0;          ///< As if sharp where nothing is known.
  double num_features = 1e9;          ///< As if plenty where nothing is known.
  double tracked_blur_percent = 0.0;  ///< The median over the frames that are not weak.
  // Parts of the frames without a pose, by their reason.
  double no_features = 0.0;
  double too_little_parallax = 0.0;
  double too_few_matches = 0.0;
  double too_few_inliers = 0.0;
  double late_part = 0.0;        ///< Of all frames.
  double unreadable_part = 0.0;  ///< Of all frames.
  /// Times between frames that are more than twice the median, before a weak frame; the longest in
  /// medians.
  std::size_t num_jumps = 0;
  double longest_jump = 0.0;
  // Of the summary.
  std::size_t lost_count = 0;
  std::size_t num_submaps = 0;
  bool is_stereo = false;
  bool is_localized = false;  ///< In a map that was there, rather than mapped.
  bool has_mistakes = false;  ///< Some were named already.
  std::optional<RunQuality> quality;
};

/// Collects them.
TroubleFigures find_trouble(const FrameTable& table, const RunSummary& summary);

/// One line of the table of advice: a cause, what it is recognised by, what to try.
struct AdviceCause {
  const char* name;  ///< Stays the same, for programs.
  /// What was seen, in words, with figures; empty where this is not the cause.
  std::string (*recognise)(const TroubleFigures&);
  const char* remedy;
  const char* section;  ///< Of docs/troubleshooting.md: its anchor.
};

/// All causes that are known, the most telling first. The one place that has them.
std::span<const AdviceCause> advice_causes();

/// What to try, by all causes that the figures show. Empty where all went well. Mistakes in the
/// calibration that the summary names are not told again.
std::vector<RunAdvice> advise(const FrameTable& table, const RunSummary& summary);

}  // namespace waymark
