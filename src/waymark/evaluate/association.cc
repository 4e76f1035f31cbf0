// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/evaluate/association.h"

#include <algorithm>

#include "waymark/base/median.h"

namespace waymark {
namespace {

constexpr std::int64_t kGapIntervals = 3;

/// Distance of two times; unsigned, since hostile ones may be 2^63 apart.
std::uint64_t distance_ns(std::int64_t a, std::int64_t b) {
  const auto low = static_cast<std::uint64_t>(std::min(a, b));
  const auto high = static_cast<std::uint64_t>(std::max(a, b));
  return high - low;
}

std::size_t nearest(std::span<const StampedPose> poses, std::int64_t time_ns) {
  const auto is_before = [](const StampedPose& pose, std::int64_t t) {
    return pose.timestamp_ns < t;
  };
  const auto after = std::lower_bound(poses.begin(), poses.end(), time_ns, is_before);
  const std::size_t index = static_cast<std::size_t>(after - poses.begin());
  if (index == poses.size()) return index - 1;
  if (index == 0) return 0;
  const std::uint64_t to_earlier = distance_ns(poses[index - 1].timestamp_ns, time_ns);
  const std::uint64_t to_later = distance_ns(poses[index].timestamp_ns, time_ns);
  return to_earlier < to_later ? index - 1 : index;
}

}  // namespace

std::vector<TimeMatch> match_by_time(std::span<const StampedPose> estimate,
                                     std::span<const StampedPose> groundtruth,
                                     std::int64_t max_difference_ns) {
  std::vector<TimeMatch> pairs;
  if (groundtruth.empty() || max_difference_ns < 0) return pairs;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const std::int64_t time_ns = estimate[i].timestamp_ns;
    const std::size_t match = nearest(groundtruth, time_ns);
    const std::uint64_t difference_ns = distance_ns(groundtruth[match].timestamp_ns, time_ns);
    if (difference_ns <= static_cast<std::uint64_t>(max_difference_ns)) pairs.push_back({i, match});
  }
  return pairs;
}

std::int64_t median_interval_ns(std::span<const StampedPose> poses) {
  if (poses.size() < 2) return 0;
  std::vector<std::uint64_t> intervals_ns;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    intervals_ns.push_back(distance_ns(poses[i - 1].timestamp_ns, poses[i].timestamp_ns));
  }
  return static_cast<std::int64_t>(std::min<std::uint64_t>(median(intervals_ns), INT64_MAX));
}

double covered_part(std::span<const StampedPose> estimate,
                    std::span<const StampedPose> groundtruth) {
  if (estimate.size() < 2 || groundtruth.size() < 2) return 0.0;
  const std::int64_t begin_ns = groundtruth.front().timestamp_ns;
  const std::int64_t end_ns = groundtruth.back().timestamp_ns;
  const double max_gap_ns =
      static_cast<double>(kGapIntervals) * static_cast<double>(median_interval_ns(estimate));
  double covered_ns = 0.0;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const std::int64_t from_ns = estimate[i - 1].timestamp_ns;
    const std::int64_t to_ns = estimate[i].timestamp_ns;
    if (static_cast<double>(distance_ns(from_ns, to_ns)) > max_gap_ns) continue;
    const std::int64_t low_ns = std::clamp(from_ns, begin_ns, end_ns);
    const std::int64_t high_ns = std::clamp(to_ns, begin_ns, end_ns);
    covered_ns += static_cast<double>(distance_ns(low_ns, high_ns));
  }
  const double duration_ns = static_cast<double>(distance_ns(begin_ns, end_ns));
  return duration_ns > 0.0 ? covered_ns / duration_ns : 0.0;
}

}  // namespace waymark
