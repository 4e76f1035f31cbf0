// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/stationary_camera.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <vector>

#include "waymark/camera/pixel_angles.h"

namespace waymark {
namespace {

using Displacements = std::vector<Eigen::Vector3f>;  ///< Of bearings of unit length.

/// Component by component; reorders them.
Eigen::Vector3f median_of(Displacements& displacements) {
  Eigen::Vector3f result;
  const auto middle = displacements.begin() + static_cast<std::ptrdiff_t>(displacements.size() / 2);
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::nth_element(
        displacements, middle, {}, [&](const Eigen::Vector3f& d) { return d[axis]; });
    result[axis] = (*middle)[axis];
  }
  return result;
}

int cell_of(double position_px, int size_px, int count) {
  return std::clamp(static_cast<int>(count * position_px / size_px), 0, count - 1);
}

}  // namespace

bool StationaryCamera::are_all_over(const Cells& staying,
                                    const Cells& telling,
                                    bool wraps,
                                    const StationaryOptions& options) {
  const auto share = static_cast<double>(staying.count()) / static_cast<double>(telling.count());
  if (wraps) return share > options.rest_share_all_around;
  std::bitset<kRows> staying_rows, telling_rows;
  std::bitset<kColumns> staying_columns, telling_columns;
  for (std::size_t i = 0; i < telling.size(); ++i) {
    if (!telling[i]) continue;
    telling_rows.set(i / kColumns), telling_columns.set(i % kColumns);
    if (staying[i]) staying_rows.set(i / kColumns), staying_columns.set(i % kColumns);
  }
  return share > options.rest_share && 2 * staying_rows.count() > telling_rows.count() &&
         2 * staying_columns.count() >= telling_columns.count();
}

void StationaryCamera::update(const Camera& camera,
                              const Features& before,
                              const Features& now,
                              std::span<const FeatureMatch> matches,
                              const StationaryOptions& options) {
  std::array<Displacements, kColumns * kRows> cells;
  for (const FeatureMatch& match : matches) {
    const Keypoint& keypoint = now.keypoints[match.b];
    const int column = cell_of(keypoint.x_px, camera.width_px(), kColumns);
    const int row = cell_of(keypoint.y_px, camera.height_px(), kRows);
    cells[static_cast<std::size_t>(row * kColumns + column)].push_back(now.bearings[match.b] -
                                                                       before.bearings[match.a]);
  }
  const double stay_rad = options.stay_px * central_pixel_angle(camera);
  Cells telling, staying;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    telling[i] = cells[i].size() >= static_cast<std::size_t>(options.min_cell_matches);
    staying[i] = telling[i] && median_of(cells[i]).norm() < stay_rad;
  }
  const std::size_t num_still = (staying & staying_).count();
  const bool goes_on = num_still >= static_cast<std::size_t>(options.min_still_cells) &&
                       2 * num_still >= staying_.count();
  const bool rests =
      goes_on || are_all_over(staying, telling, camera.wrap_width_px() > 0.0, options);
  staying_ = rests ? staying : Cells{};
}

}  // namespace waymark
