// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/evaluate/segments.h"

#include <algorithm>
#include <array>

#include "waymark/base/check.h"
#include "waymark/geometry/so3.h"

namespace waymark {
namespace {

constexpr std::array<double, 8> kLengths = {100, 200, 300, 400, 500, 600, 700, 800};
constexpr std::size_t kStartStep = 10;
constexpr double kDegPerRadian = 57.29577951308232;

std::vector<double> path_lengths(std::span<const Rigid3> poses) {
  std::vector<double> lengths(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    lengths[i] = lengths[i - 1] + (poses[i].translation - poses[i - 1].translation).norm();
  }
  return lengths;
}

void add(SegmentError& sum, const SegmentError& other) {
  sum.length_m += other.length_m;
  sum.translation_percent += other.translation_percent;
  sum.rotation_deg_per_100m += other.rotation_deg_per_100m;
  sum.num_segments += other.num_segments;
}

SegmentError mean_of(const SegmentError& sum) {
  const double n = static_cast<double>(sum.num_segments);
  return {sum.length_m / n,
          sum.translation_percent / n,
          sum.rotation_deg_per_100m / n,
          sum.num_segments};
}

}  // namespace

std::optional<SegmentErrors> segment_errors(std::span<const Rigid3> estimate,
                                            std::span<const Rigid3> groundtruth) {
  WAYMARK_CHECK(estimate.size() == groundtruth.size());
  const std::vector<double> lengths = path_lengths(groundtruth);
  SegmentErrors errors;
  for (double length : kLengths) {
    SegmentError sum;
    for (std::size_t first = 0; first < groundtruth.size(); first += kStartStep) {
      const auto end = std::upper_bound(lengths.begin(), lengths.end(), lengths[first] + length);
      if (end == lengths.end()) break;
      const std::size_t last = static_cast<std::size_t>(end - lengths.begin());
      const Rigid3 true_motion = groundtruth[first].inverse() * groundtruth[last];
      const Rigid3 motion = estimate[first].inverse() * estimate[last];
      const Rigid3 error = motion.inverse() * true_motion;
      add(sum,
          {length,
           100.0 * error.translation.norm() / length,
           100.0 * kDegPerRadian * so3_log(error.rotation).norm() / length,
           1});
    }
    if (sum.num_segments == 0) continue;
    add(errors.all, sum);
    errors.by_length.push_back(mean_of(sum));
  }
  if (errors.by_length.empty()) return std::nullopt;
  errors.all = mean_of(errors.all);
  return errors;
}

}  // namespace waymark
