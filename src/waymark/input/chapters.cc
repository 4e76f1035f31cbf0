// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/input/datasets.h"
#include "waymark/input/listing.h"
#include "waymark/input/video_file.h"

namespace waymark {
namespace {

/// A file of a GoPro: "GH" "01" "0123", or of older ones "GOPR0123" and then "GP" "01" "0123".
struct Chapter {
  std::string kind;
  int number = 0;
  std::string recording;
};

std::optional<Chapter> chapter_of(const std::filesystem::path& path) {
  const std::string name = path.stem().string();
  const auto has_digits_from = [&](std::size_t first) {
    return name.find_first_not_of("0123456789", first) == std::string::npos;
  };
  if (name.size() != 8 || !has_digits_from(4)) return std::nullopt;
  if (name.starts_with("GOPR")) return Chapter{"GP", 0, name.substr(4)};
  const bool is_chapter = name[0] == 'G' && name[1] >= 'A' && name[1] <= 'Z' && has_digits_from(2);
  if (!is_chapter) return std::nullopt;
  return Chapter{name.substr(0, 2), std::atoi(name.substr(2, 2).c_str()), name.substr(4)};
}

bool goes_on_by_name(const std::filesystem::path& path, const std::filesystem::path& next) {
  const std::optional<Chapter> a = chapter_of(path);
  const std::optional<Chapter> b = chapter_of(next);
  return a && b && a->kind == b->kind && a->recording == b->recording && b->number == a->number + 1;
}

/// Whether one was begun when the other ended, and the pictures are alike.
bool goes_on_in_time(const VideoFile& file, const VideoFile& next) {
  constexpr double kInexact_s = 2.0;  // Whole seconds are noted, and closing a file takes some.
  const std::optional<std::int64_t> begin_s = file.created_s();
  const std::optional<std::int64_t> next_s = next.created_s();
  if (!begin_s || !next_s || file.rate_hz() <= 0.0) return false;
  const double duration_s = file.num_frames() / file.rate_hz();
  const VideoTrack& track = file.track();
  return duration_s > 2.0 * kInexact_s &&
         std::abs(static_cast<double>(*next_s - *begin_s) - duration_s) <= kInexact_s &&
         track.codec == next.track().codec && track.width_px == next.track().width_px &&
         track.height_px == next.track().height_px;
}

}  // namespace

std::vector<std::filesystem::path> find_chapters(const std::filesystem::path& folder) {
  const std::vector<std::filesystem::path> videos = list_videos(folder);
  const auto is_file = [](const auto& path) { return std::filesystem::is_regular_file(path); };
  if (!std::ranges::all_of(videos, is_file)) return {};
  try {
    for (std::size_t i = 1; i < videos.size(); ++i) {
      if (goes_on_by_name(videos[i - 1], videos[i])) continue;
      if (!goes_on_in_time(VideoFile(videos[i - 1]), VideoFile(videos[i]))) return {};
    }
  } catch (const InputError&) {
    return {};
  }
  return videos;
}

}  // namespace waymark
