// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "waymark/base/median.h"

namespace waymark {
namespace {

/// Where a pose rests on fewer, it may go next.
constexpr int kFewInliers = 30;
/// Trouble is worth a word from here on.
constexpr double kMinWeakPart = 0.05;

// Of 16 recordings and what script/evaluation/degrade.py makes of them: as they are, images have a
// brightness of 87 to 164, a contrast of 34 to 104 and a blur of 22 to 55 %. Made dark (level 2)
// 33 to 49 and 8 to 21; flat (level 3) 101 or more and 10 to 31; blurred along 15 px 50 to 71 %.
constexpr double kDark = 52.0;
constexpr double kDarkContrast = 23.0;
constexpr double kFlatContrast = 27.0;
constexpr double kBlurredPercent = 50.0;
constexpr double kMoreBlurPercent = 12.0;  ///< Than where all goes well,
constexpr double kSomeBlurPercent = 40.0;  ///< and so much at least.

constexpr double kMinBlurContrast = 8.0;  ///< Below nothing can be said of it.

constexpr double kFewFeatures = 250.0;  ///< Of the 1000 that are asked for.
constexpr double kJump = 2.0;           ///< In median times between frames.

// See verdict.cc for what is usual.
constexpr double kMaxReprojectionPx = 1.2;
constexpr double kMinMatchesKept = 0.7;
constexpr double kMaxReprojectionPercent = 0.2;

bool is_dark(const TroubleFigures& seen) {
  return seen.brightness <= kDark && seen.contrast <= kDarkContrast;
}

bool is_flat(const TroubleFigures& seen) {
  return !is_dark(seen) && seen.contrast <= kFlatContrast;
}

bool is_blurred(const TroubleFigures& seen) {
  const bool is_more = seen.tracked_blur_percent > 0.0 &&
                       seen.blur_percent > seen.tracked_blur_percent + kMoreBlurPercent;
  return seen.blur_percent >= kBlurredPercent || (is_more && seen.blur_percent >= kSomeBlurPercent);
}

bool is_weak(const TroubleFigures& seen) { return seen.weak_part >= kMinWeakPart; }

bool has_poor_images(const TroubleFigures& seen) {
  return is_weak(seen) && (is_dark(seen) || is_flat(seen) || is_blurred(seen));
}

std::string recognise_dark(const TroubleFigures& seen) {
  if (!is_weak(seen) || !is_dark(seen)) return "";
  return fmt::format(
      "the images are dark: brightness {:.0f} and contrast {:.0f} of 255 where frames have no pose "
      "or a weak one",
      seen.brightness,
      seen.contrast);
}

std::string recognise_flat(const TroubleFigures& seen) {
  if (!is_weak(seen) || !is_flat(seen)) return "";
  return fmt::format(
      "the images are flat: contrast {:.0f} of 255 where frames have no pose or a weak one",
      seen.contrast);
}

std::string recognise_blur(const TroubleFigures& seen) {
  if (!is_weak(seen) || seen.contrast < kMinBlurContrast || !is_blurred(seen)) return "";
  std::string text =
      fmt::format("the images are blurred: by {:.0f} % where frames have no pose or a weak one",
                  seen.blur_percent);
  if (seen.tracked_blur_percent > 0.0) {
    text += fmt::format(", {:.0f} % elsewhere", seen.tracked_blur_percent);
  }
  return text;
}

std::string recognise_few_features(const TroubleFigures& seen) {
  if (!is_weak(seen) || has_poor_images(seen)) return "";
  if (seen.num_features >= kFewFeatures && seen.no_features < 0.3) return "";
  const std::string count =
      seen.num_features < 1e6 ? fmt::format(", {:.0f} in the median", seen.num_features) : "";
  return fmt::format("few features in images that are neither dark nor blurred{}", count);
}

std::string recognise_no_parallax(const TroubleFigures& seen) {
  if (seen.too_little_parallax < 0.3 || seen.is_localized) return "";
  if (seen.has_started && seen.poseless_part < 0.1) return "";
  return fmt::format(
      "{}: for {:.0f} % of the frames without a pose the camera has hardly moved sideways",
      seen.has_started ? "parts have no map" : "it did not start",
      100.0 * seen.too_little_parallax);
}

std::string recognise_jumps(const TroubleFigures& seen) {
  if (seen.num_jumps == 0) return "";
  return fmt::format(
      "jumps in time: {} before frames without a pose or with a weak one, up to {:.0f} times the "
      "usual step",
      seen.num_jumps,
      seen.longest_jump);
}

std::string recognise_late(const TroubleFigures& seen) {
  if (seen.late_part < kMinWeakPart) return "";
  return fmt::format("{:.0f} % of the frames came before the one before them was done",
                     100.0 * seen.late_part);
}

std::string recognise_unreadable(const TroubleFigures& seen) {
  if (seen.unreadable_part < 0.01) return "";
  return fmt::format("{:.0f} % of the images could not be used", 100.0 * seen.unreadable_part);
}

std::string recognise_pair(const TroubleFigures& seen) {
  if (!seen.is_stereo || seen.has_started || seen.too_few_matches < 0.5) return "";
  if (seen.has_mistakes || has_poor_images(seen)) return "";
  return "a stereo pair that does not start: what camera 1 sees is not where the calibration says";
}

std::string recognise_calibration(const TroubleFigures& seen) {
  if (seen.has_mistakes) return "";
  if (seen.quality && seen.has_started) {
    const RunQuality& quality = *seen.quality;
    if (quality.reprojection_px > kMaxReprojectionPx || quality.matches_kept < kMinMatchesKept) {
      return fmt::format(
          "what was matched does not fit together: reprojection error {:.2f} px, {:.0f} % of the "
          "matches kept",
          quality.reprojection_px,
          100.0 * quality.matches_kept);
    }
  }
  if (seen.poseless_part < 0.1 || seen.too_few_inliers < 0.4 || has_poor_images(seen)) return "";
  return fmt::format("matches contradict each other in {:.0f} % of the frames without a pose",
                     100.0 * seen.too_few_inliers);
}

std::string recognise_coarse(const TroubleFigures& seen) {
  if (!seen.quality || !seen.has_started) return "";
  if (!(seen.quality->reprojection_percent > kMaxReprojectionPercent)) return "";
  return fmt::format(
      "the result is poor: the reprojection error of {:.2f} px is {:.2f} % of images as small as "
      "these",
      seen.quality->reprojection_px,
      seen.quality->reprojection_percent);
}

std::string recognise_fast_motion(const TroubleFigures& seen) {
  if (!is_weak(seen) || has_poor_images(seen) || seen.num_features < kFewFeatures) return "";
  if (seen.is_localized || seen.too_few_matches < 0.3 || !recognise_pair(seen).empty()) return "";
  return fmt::format(
      "sharp images with too few matches, {:.0f} % of the frames without a pose: one shows too "
      "little of what the one before does",
      100.0 * seen.too_few_matches);
}

std::string recognise_losses(const TroubleFigures& seen) {
  if (seen.lost_count < 3 || seen.is_localized) return "";
  return fmt::format("lost {} times in {:.0f} frames", seen.lost_count, seen.num_frames);
}

std::string recognise_parts(const TroubleFigures& seen) {
  if (seen.num_submaps < 2 || seen.is_localized) return "";
  return fmt::format("the map is in {} parts, each with a world of its own", seen.num_submaps);
}

std::string recognise_not_in_map(const TroubleFigures& seen) {
  if (!seen.is_localized || seen.poseless_part < 0.1) return "";
  return fmt::format("{:.0f} % of the images were not found in the map",
                     100.0 * seen.poseless_part);
}

constexpr std::array kCauses = {
    AdviceCause{"dark",
                recognise_dark,
                "more light, or a longer exposure as long as nothing smears; with a good sensor "
                "--set features.min_contrast=4",
                "the-images-are-dark"},
    AdviceCause{"flat",
                recognise_flat,
                "clean the lens, switch noise reduction off, look where there is texture; --set "
                "features.min_contrast=4",
                "the-images-are-flat"},
    AdviceCause{"blur",
                recognise_blur,
                "a shorter exposure with more gain or light, slower turns, and a look at the focus",
                "the-images-are-blurred"},
    AdviceCause{"few_features",
                recognise_few_features,
                "a wider view, or look along walls rather than at them",
                "there-is-little-to-see"},
    AdviceCause{"no_parallax",
                recognise_no_parallax,
                "move the camera sideways, by a hand's breadth indoors; turning on the spot does "
                "not help",
                "the-camera-does-not-move-sideways"},
    AdviceCause{"pair",
                recognise_pair,
                "each camera alone with --setup mono; where that works, the transform between the "
                "cameras is wrong",
                "a-stereo-pair-does-not-start-or-starts-late"},
    AdviceCause{"calibration",
                recognise_calibration,
                "check that it is the calibration of this camera at this size; waymark calibrate "
                "finds one from the images",
                "the-calibration-does-not-fit"},
    AdviceCause{"coarse",
                recognise_coarse,
                "images of more pixels; expect a rough and bent map",
                "the-images-are-coarse"},
    AdviceCause{"jumps",
                recognise_jumps,
                "find out why images are missing: a full disk, a slow cable, a cut; move slowly, "
                "or back, after an interruption",
                "time-jumps"},
    AdviceCause{"late",
                recognise_late,
                "smaller images, fewer features.count, or a lower rate of the camera",
                "frames-are-dropped"},
    AdviceCause{"unreadable",
                recognise_unreadable,
                "look at the warnings, which name the files: copy or export them once more",
                "images-cannot-be-used"},
    AdviceCause{"fast_motion",
                recognise_fast_motion,
                "move and turn more slowly, use every image (--every 1) of 30 per second, turn in "
                "an arc rather than on the spot",
                "it-is-lost-in-turns"},
    AdviceCause{"losses",
                recognise_losses,
                "look at the report, at what happens around the losses; a wider lens, a stereo "
                "pair or depth hold on longer",
                "it-is-lost-again-and-again"},
    AdviceCause{"parts",
                recognise_parts,
                "pass a place of the first part once more, looking as then, or go on later with "
                "--map-in",
                "there-are-several-sub-maps"},
    AdviceCause{"not_in_map",
                recognise_not_in_map,
                "images from where the map was made, with the calibration of their own camera; "
                "maps with --set features.count=2000",
                "images-are-not-found-in-a-map"},
};

bool was_looked_at(const FrameRecord& frame) {
  return frame.state != FrameState::kUnreadable && frame.state != FrameState::kDropped;
}

bool has_pose(const FrameRecord& frame) {
  return frame.state == FrameState::kTracked || frame.state == FrameState::kFilled;
}

bool is_weak_frame(const FrameRecord& frame) {
  if (!has_pose(frame)) return true;
  return frame.state == FrameState::kTracked && frame.num_inliers < kFewInliers;
}

double median_or(std::vector<double> values, double otherwise) {
  return values.empty() ? otherwise : median(std::move(values));
}

void add_pictures(std::span<const FrameRecord> frames, TroubleFigures& seen) {
  std::vector<double> brightness, contrast, blur, features, tracked_blur;
  for (const FrameRecord& frame : frames) {
    if (!was_looked_at(frame)) continue;
    const ImageStatistics& picture = frame.picture;
    if (!is_weak_frame(frame)) {
      if (picture.is_known) tracked_blur.push_back(picture.blur_percent);
      continue;
    }
    if (frame.num_features) features.push_back(*frame.num_features);
    if (!picture.is_known) continue;
    brightness.push_back(picture.brightness);
    contrast.push_back(picture.contrast);
    blur.push_back(picture.blur_percent);
  }
  seen.brightness = median_or(std::move(brightness), seen.brightness);
  seen.contrast = median_or(std::move(contrast), seen.contrast);
  seen.blur_percent = median_or(std::move(blur), seen.blur_percent);
  seen.num_features = median_or(std::move(features), seen.num_features);
  seen.tracked_blur_percent = median_or(std::move(tracked_blur), seen.tracked_blur_percent);
}

void add_reasons(std::span<const FrameRecord> frames, TroubleFigures& seen) {
  double num_poseless = 0.0;
  const auto part = [&](FrameReason reason) {
    const auto is_so = [reason](const FrameRecord& frame) {
      return was_looked_at(frame) && !has_pose(frame) && frame.reason == reason;
    };
    return static_cast<double>(std::ranges::count_if(frames, is_so)) / std::max(num_poseless, 1.0);
  };
  for (const FrameRecord& frame : frames) num_poseless += was_looked_at(frame) && !has_pose(frame);
  seen.poseless_part = num_poseless / std::max(seen.num_frames, 1.0);
  seen.no_features = part(FrameReason::kNoFeatures);
  seen.too_little_parallax = part(FrameReason::kTooLittleParallax);
  seen.too_few_matches = part(FrameReason::kTooFewMatches);
  seen.too_few_inliers = part(FrameReason::kTooFewInliers);
}

/// Only gaps that did harm count.
void add_jumps(std::span<const FrameRecord> frames, TroubleFigures& seen) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    steps.push_back(static_cast<double>(frames[i].timestamp_ns) -
                    static_cast<double>(frames[i - 1].timestamp_ns));
  }
  const double usual = median_or(steps, 0.0);
  if (!(usual > 0.0)) return;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const bool is_harmed = was_looked_at(frames[i]) && is_weak_frame(frames[i]);
    const bool was_well = !was_looked_at(frames[i - 1]) || !is_weak_frame(frames[i - 1]);
    if (!is_harmed || !was_well || steps[i - 1] <= kJump * usual) continue;
    ++seen.num_jumps;
    seen.longest_jump = std::max(seen.longest_jump, steps[i - 1] / usual);
  }
}

}  // namespace

TroubleFigures find_trouble(const FrameTable& table, const RunSummary& summary) {
  const std::span<const FrameRecord> frames = table.frames;
  TroubleFigures seen;
  double num_weak = 0.0, num_late = 0.0, num_unreadable = 0.0;
  for (const FrameRecord& frame : frames) {
    seen.num_frames += was_looked_at(frame);
    num_weak += was_looked_at(frame) && is_weak_frame(frame);
    num_late += frame.state == FrameState::kDropped;
    num_unreadable += frame.state == FrameState::kUnreadable;
    seen.has_started = seen.has_started || frame.state == FrameState::kTracked;
  }
  const double num_all = std::max(static_cast<double>(frames.size()), 1.0);
  seen.weak_part = num_weak / std::max(seen.num_frames, 1.0);
  seen.late_part = num_late / num_all;
  seen.unreadable_part = num_unreadable / num_all;
  add_pictures(frames, seen);
  add_reasons(frames, seen);
  add_jumps(frames, seen);
  seen.lost_count = count_frames(frames).lost_count;
  seen.is_localized = summary.localized.has_value();
  seen.num_submaps = summary.submaps;
  seen.is_stereo = summary.setup == "stereo";
  seen.has_mistakes = summary.mistakes && !summary.mistakes->empty();
  seen.quality = summary.quality;
  return seen;
}

std::span<const AdviceCause> advice_causes() { return kCauses; }

std::vector<RunAdvice> advise(const FrameTable& table, const RunSummary& summary) {
  std::vector<RunAdvice> advice;
  if (table.frames.empty()) return advice;
  const TroubleFigures seen = find_trouble(table, summary);
  for (const AdviceCause& cause : kCauses) {
    const std::string text = cause.recognise(seen);
    if (text.empty()) continue;
    advice.push_back(
        {cause.name, text, cause.remedy, fmt::format("docs/troubleshooting.md#{}", cause.section)});
  }
  return advice;
}

}  // namespace waymark
