// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/rest.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace waymark {
namespace {

constexpr int kColumns = 6;
constexpr int kRows = 4;
/// Matches that tell what a cell of the image does.
constexpr int kMinCellMatches = 3;
/// Of its cells, the share that stays: more than what moves before a camera leaves at times, and
/// more than what moves along with one.
constexpr double kRestShare = 0.5;
constexpr double kRestShareAllAround = 0.75;
/// In standard deviations of the distance: a pixel and a half of the feature's level.
constexpr double kStaySigmas = 1.0;

struct Cell {
  int num_matches = 0;
  int num_staying = 0;
};

bool stays(const Features& before, const Features& now, const FeatureMatch& match) {
  const float sigma_rad = std::hypot(before.size_rad[match.a], now.size_rad[match.b]);
  return (now.bearings[match.b] - before.bearings[match.a]).norm() <
         static_cast<float>(kStaySigmas) * sigma_rad;
}

int cell_of(double position_px, int size_px, int count) {
  return std::clamp(static_cast<int>(count * position_px / size_px), 0, count - 1);
}

}  // namespace

bool is_at_rest(const Camera& camera,
                const Features& before,
                const Features& now,
                std::span<const FeatureMatch> matches) {
  std::array<Cell, kColumns * kRows> cells;
  for (const FeatureMatch& match : matches) {
    const Keypoint& keypoint = now.keypoints[match.b];
    const int column = cell_of(keypoint.x_px, camera.width_px(), kColumns);
    const int row = cell_of(keypoint.y_px, camera.height_px(), kRows);
    Cell& cell = cells[static_cast<std::size_t>(row * kColumns + column)];
    ++cell.num_matches;
    cell.num_staying += stays(before, now, match);
  }
  const auto tells = [](const Cell& cell) { return cell.num_matches >= kMinCellMatches; };
  const auto is_staying = [&](const Cell& cell) {
    return tells(cell) && 2 * cell.num_staying > cell.num_matches;
  };
  const auto num_telling = std::ranges::count_if(cells, tells);
  const auto num_staying = std::ranges::count_if(cells, is_staying);
  const double share = camera.wrap_width_px() > 0.0 ? kRestShareAllAround : kRestShare;
  return static_cast<double>(num_staying) > share * static_cast<double>(num_telling);
}

}  // namespace waymark
