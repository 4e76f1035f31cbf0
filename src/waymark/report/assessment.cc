// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/assessment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "waymark/base/median.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

/// From where on a figure is good, and below or above which it is bad.
struct Limits {
  double good;
  double bad;
};

// What is called usual is that of six recordings that went well: a car in mono and in stereo, a
// drone in stereo, a hand with depth, 360 degrees in a car, a simulated shop in mono.

/// 1.00 is usual. A recording whose last tenth is missing may still serve; half a one is another
/// one.
constexpr Limits kCoverage{0.95, 0.7};
/// Losses per 1000 frames: none is usual. More than 10 (one in four seconds) leave short pieces.
constexpr Limits kLosses{0.0, 10.0};
/// Inliers of a frame in the median: 119 to 387 are usual. A pose needs 10 or so at the least, and
/// one below 30 is taken for weak elsewhere; at 60 half of them may go.
constexpr Limits kInliers{60.0, 30.0};
/// Reprojection error in px: 0.49 to 0.88 is usual; simulated images have 0.3.
constexpr Limits kReprojection{1.0, 1.6};
/// The same in percent of the longer side: 0.03 to 0.14 is usual, also of wide lenses; from 0.2 on,
/// as in images of 200x150 px, maps are rough and may be bent.
constexpr double kReprojectionPercent = 0.2;
/// Matches kept: .82 to .94 is usual.
constexpr Limits kMatchesKept{0.75, 0.6};
/// ATE in percent of the path: 0.08 to 0.6 is usual, and 2.2 with the hand, whose path is 0.7 m.
constexpr Limits kAtePercent{1.0, 3.0};
/// An ATE that is good however short the path is.
constexpr double kSmallAteM = 0.02;
/// Part of the images that could not be used or came too late.
constexpr Limits kMissing{0.01, 0.2};
/// By how much of itself a focal length may be changed by the images before the rest of a
/// calibration is in doubt, too.
constexpr double kFocalChange = 0.03;

Grade grade_of(double value, const Limits& limits) {
  const bool is_more_better = limits.good > limits.bad;
  if (is_more_better ? value >= limits.good : value <= limits.good) return Grade::kGood;
  return (is_more_better ? value >= limits.bad : value <= limits.bad) ? Grade::kCheck : Grade::kBad;
}

Judgement judge_coverage(const FrameCounts& counts, const RunSummary& summary) {
  const double num_frames = static_cast<double>(std::max<std::size_t>(counts.frames, 1));
  const double coverage = static_cast<double>(summary.num_trajectory_lines) / num_frames;
  return {
      "Coverage",
      grade_of(coverage, kCoverage),
      fmt::format("{:.0f} %", 100.0 * coverage),
      fmt::format("{} of {} frames have a pose in the largest part of the map; good from {:.0f} "
                  "%, bad below {:.0f} %",
                  summary.num_trajectory_lines,
                  counts.frames,
                  100.0 * kCoverage.good,
                  100.0 * kCoverage.bad)};
}

Judgement judge_losses(const FrameCounts& counts) {
  const double per_1000 = 1000.0 * static_cast<double>(counts.lost_count) /
                          static_cast<double>(std::max<std::size_t>(counts.frames, 1));
  return {
      "Losses",
      grade_of(per_1000, kLosses),
      fmt::format("{}", counts.lost_count),
      fmt::format("how often the camera was lost; bad above {:.0f} in 1000 frames", kLosses.bad)};
}

std::optional<Judgement> judge_parts(const RunSummary& summary) {
  if (summary.localized || summary.submaps == 0) return std::nullopt;
  return Judgement{"Parts of the map",
                   summary.submaps == 1 ? Grade::kGood : Grade::kCheck,
                   fmt::format("{}", summary.submaps),
                   "parts that were not joined have a world of their own each; one is good"};
}

std::optional<Judgement> judge_inliers(const FrameTable& table) {
  std::vector<int> inliers;
  for (const FrameRecord& frame : table.frames) {
    if (frame.state == FrameState::kTracked) inliers.push_back(frame.num_inliers);
  }
  if (inliers.empty()) return std::nullopt;
  const int middle = median(inliers);
  return Judgement{
      "Inliers",
      grade_of(middle, kInliers),
      fmt::format("{}", middle),
      fmt::format("landmarks that the pose of a frame rests on, in the median; good from "
                  "{:.0f}, bad below {:.0f}",
                  kInliers.good,
                  kInliers.bad)};
}

std::vector<Judgement> judge_agreement(const RunQuality& quality) {
  const bool is_coarse = quality.reprojection_percent > kReprojectionPercent;
  return {
      {"Reprojection error",
       std::max(grade_of(quality.reprojection_px, kReprojection),
                is_coarse ? Grade::kCheck : Grade::kGood),
       fmt::format("{:.2f} px, {:.2f} %", quality.reprojection_px, quality.reprojection_percent),
       fmt::format("how far landmarks are from where they are seen; good up to {:.1f} px and "
                   "{:.1f} % of the image's longer side, bad above {:.1f} px. It grows with a "
                   "wrong calibration and with blur; few pixels are a large part of small images",
                   kReprojection.good,
                   kReprojectionPercent,
                   kReprojection.bad)},
      {"Matches kept",
       grade_of(quality.matches_kept, kMatchesKept),
       fmt::format("{:.0f} %", 100.0 * quality.matches_kept),
       fmt::format("matches that agree on the pose; good from {:.0f} %, bad below {:.0f} %",
                   100.0 * kMatchesKept.good,
                   100.0 * kMatchesKept.bad)}};
}

/// The largest change of a focal length by the images, as a part of it.
double focal_change(const RunSummary& summary) {
  double largest = 0.0;
  for (const CalibrationEstimate& estimate : summary.refined_calibration) {
    const bool is_focal = estimate.name.ends_with(".fu") || estimate.name.ends_with(".fv");
    if (!is_focal || !estimate.is_changed() || !(estimate.given > 0.0)) continue;
    largest = std::max(largest, std::abs(estimate.change) / estimate.given);
  }
  return largest;
}

Judgement judge_calibration(const RunSummary& summary) {
  const double change = focal_change(summary);
  const std::size_t num_mistakes = summary.mistakes ? summary.mistakes->size() : 0;
  Judgement judgement{"Calibration", Grade::kCheck, "", ""};
  if (num_mistakes > 0) {
    judgement.value = count_of(num_mistakes, "warning");
    judgement.why = summary.mistakes->front();
  } else if (summary.calibration && !summary.calibration->is_sure) {
    judgement.value = "estimated, not sure";
    judgement.why = "none was given, and the motion did not tell it: expect bent walls";
  } else if (change > kFocalChange) {
    judgement.value = fmt::format("off by {:.1f} %", 100.0 * change);
    judgement.why = fmt::format(
        "the images changed the focal length by more than {:.0f} %: is it the calibration of this "
        "camera at this size?",
        100.0 * kFocalChange);
  } else {
    judgement.grade = Grade::kGood;
    judgement.value = summary.calibration ? "estimated" : "fits";
    judgement.why = summary.calibration ? "none was given, the images told it"
                                        : "the images do not contradict what was given";
  }
  return judgement;
}

std::optional<Judgement> judge_missing(const FrameCounts& counts) {
  if (counts.unreadable + counts.dropped == 0) return std::nullopt;
  const double part = static_cast<double>(counts.unreadable + counts.dropped) /
                      static_cast<double>(std::max<std::size_t>(counts.frames, 1));
  return Judgement{"Images not used",
                   grade_of(part, kMissing),
                   fmt::format("{}", counts.unreadable + counts.dropped),
                   fmt::format("{} could not be used, {} came too late; good up to {:.0f} % of all",
                               counts.unreadable,
                               counts.dropped,
                               100.0 * kMissing.good)};
}

std::optional<Judgement> judge_truth(const Evaluation* truth) {
  if (!truth || !truth->ate_percent) return std::nullopt;
  const bool is_small = truth->ate_m.rmse <= kSmallAteM;
  return Judgement{
      "Error against the ground truth",
      is_small ? Grade::kGood : grade_of(*truth->ate_percent, kAtePercent),
      fmt::format("{:.3g} m, {:.2g} % of the path", truth->ate_m.rmse, *truth->ate_percent),
      fmt::format("absolute trajectory error, root mean square; good up to {:.0f} % of the path "
                  "or {:g} m, bad above {:.0f} %",
                  kAtePercent.good,
                  kSmallAteM,
                  kAtePercent.bad)};
}

}  // namespace

std::string_view to_string(Grade grade) {
  switch (grade) {
    case Grade::kGood:
      return "good";
    case Grade::kCheck:
      return "check";
    case Grade::kBad:
      return "bad";
  }
  return "unknown";
}

std::string Assessment::names_of(Grade wanted) const {
  std::string names;
  for (const Judgement& judgement : judgements) {
    if (judgement.grade != wanted) continue;
    names += (names.empty() ? "" : ", ") + judgement.name;
  }
  return names;
}

Assessment judge(const FrameTable& table, const RunSummary& summary, const Evaluation* truth) {
  Assessment verdict;
  std::vector<Judgement>& all = verdict.judgements;
  const auto add = [&all](std::optional<Judgement> judgement) {
    if (judgement) all.push_back(*std::move(judgement));
  };
  const FrameCounts counts = count_frames(table.frames);
  add(judge_truth(truth));
  add(judge_coverage(counts, summary));
  if (!summary.localized) add(judge_losses(counts));
  add(judge_parts(summary));
  add(judge_inliers(table));
  if (summary.quality && counts.tracked > 0) {
    for (Judgement& judgement : judge_agreement(*summary.quality))
      all.push_back(std::move(judgement));
  }
  add(judge_calibration(summary));
  add(judge_missing(counts));
  for (const Judgement& judgement : all) verdict.grade = std::max(verdict.grade, judgement.grade);
  return verdict;
}

}  // namespace waymark
