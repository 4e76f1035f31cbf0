// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/world_motion.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "waymark/geometry/essential.h"
#include "waymark/geometry/relative_pose.h"
#include "waymark/geometry/view_regions.h"

namespace waymark {
namespace {

/// At first two motions are close to each other: what tells them apart is less noise than is
/// allowed for otherwise.
constexpr double kNoiseShare = 0.5;
/// Matches that the motion leaves out, as a share of all, and of them those that agree on another:
/// so many are no accident. Wrong matches agree in part.
constexpr double kLeftOutShare = 0.15;
constexpr double kAgreeingShare = 0.75;
/// How much more of the view must agree with one of two motions.
constexpr double kClearly = 1.25;

/// Some of the matches, with less noise.
struct MatchList {
  std::vector<Eigen::Vector3d> a, b;
  std::vector<double> sigmas_rad_a, sigmas_rad_b;

  MatchList(const BearingMatches& matches, const std::vector<std::uint32_t>& chosen) {
    for (const std::uint32_t i : chosen) {
      a.push_back(matches.bearings_a[i]);
      b.push_back(matches.bearings_b[i]);
      sigmas_rad_a.push_back(kNoiseShare * matches.sigmas_rad_a[i]);
      sigmas_rad_b.push_back(kNoiseShare * matches.sigmas_rad_b[i]);
    }
  }
  BearingMatches view() const { return {a, b, sigmas_rad_a, sigmas_rad_b}; }
};

MatchList with_less_noise(const BearingMatches& matches) {
  std::vector<std::uint32_t> all(matches.size());
  std::iota(all.begin(), all.end(), 0u);
  return MatchList(matches, all);
}

/// Whether regions of the view are off as a whole. What is left out is not asked.
bool is_contradicted(const TwoViewGeometry& geometry,
                     const BearingMatches& matches,
                     ViewRegions& regions) {
  Contradiction contradiction;
  regions.for_each([&](std::span<const std::uint32_t> members) {
    double count = 0.0, sum = 0.0, sum_of_squares = 0.0;
    for (const std::uint32_t i : members) {
      if (!geometry.is_inlier[i]) continue;
      const double error = epipolar_residual(geometry.b_from_a, matches, i).value;
      count += 1.0;
      sum += error;
      sum_of_squares += error * error;
    }
    contradiction.add(count, sum * sum, sum_of_squares);
  });
  return contradiction.ratio() > Contradiction::kMax;
}

/// The motion that those matches agree on which another leaves out, if they are many.
std::optional<TwoViewGeometry> find_rival(const TwoViewGeometry& geometry,
                                          const BearingMatches& matches,
                                          const TwoViewOptions& options) {
  std::vector<std::uint32_t> left_out;
  for (std::uint32_t i = 0; i < matches.size(); ++i) {
    if (!geometry.is_inlier[i]) left_out.push_back(i);
  }
  const auto count = static_cast<double>(left_out.size());
  if (count < kLeftOutShare * static_cast<double>(matches.size())) return std::nullopt;
  TwoViewOptions of_others = options;
  of_others.min_num_points = static_cast<int>(static_cast<double>(options.min_num_points) * count /
                                              static_cast<double>(matches.size()));
  TwoViewResult rival = estimate_two_view(MatchList(matches, left_out).view(), of_others);
  if (!rival.geometry) return std::nullopt;
  const auto num_agreeing = std::ranges::count(rival.geometry->is_inlier, std::uint8_t{1});
  if (static_cast<double>(num_agreeing) < kAgreeingShare * count) return std::nullopt;
  return std::move(rival.geometry);
}

/// How many regions agree with a motion, in parts where not all of one does.
double num_agreeing(const Rigid3& b_from_a, const BearingMatches& matches, ViewRegions& regions) {
  const Eigen::Matrix3d essential = essential_from_pose(b_from_a);
  double sum = 0.0;
  regions.for_each([&](std::span<const std::uint32_t> members) {
    const auto count = std::ranges::count_if(members, [&](std::uint32_t i) {
      return squared_epipolar_error(essential, matches, i) < kMaxSquaredEpipolarError;
    });
    sum += static_cast<double>(count) / static_cast<double>(members.size());
  });
  return sum;
}

/// Of a motion and its rival, the one that more of the view agrees on.
TwoViewResult elect(TwoViewResult first,
                    const TwoViewGeometry& rival,
                    const BearingMatches& matches,
                    const TwoViewOptions& options,
                    ViewRegions& regions) {
  const MatchList narrow = with_less_noise(matches);
  const double by_first = num_agreeing(first.geometry->b_from_a, narrow.view(), regions);
  const double by_rival = num_agreeing(rival.b_from_a, narrow.view(), regions);
  if (by_first > kClearly * by_rival) return first;
  if (by_rival > kClearly * by_first) {
    return take_motion(rival.b_from_a, rival.model, narrow.view(), options);
  }
  return {TwoViewStatus::kAmbiguous, std::nullopt};
}

TwoViewResult estimate_by_regions(const BearingMatches& matches,
                                  const TwoViewOptions& options,
                                  ViewRegions& regions) {
  const MatchList votes(matches, regions.votes());
  TwoViewOptions of_votes = options;
  of_votes.min_num_points =
      static_cast<int>(static_cast<double>(options.min_num_points) *
                       static_cast<double>(votes.a.size()) / static_cast<double>(matches.size()));
  const TwoViewResult elected = estimate_two_view(votes.view(), of_votes);
  if (!elected.geometry) return elected;
  std::vector<std::uint32_t> all(matches.size());
  std::iota(all.begin(), all.end(), 0u);
  return take_motion(
      elected.geometry->b_from_a, elected.geometry->model, MatchList(matches, all).view(), options);
}

}  // namespace

TwoViewResult estimate_world_motion(const BearingMatches& matches, const TwoViewOptions& options) {
  TwoViewResult result = estimate_two_view(matches, options);
  if (!result.geometry) return result;
  ViewRegions regions;
  regions.sort(matches.bearings_b);
  if (!is_contradicted(*result.geometry, matches, regions)) {
    const auto rival = find_rival(*result.geometry, matches, options);
    return rival ? elect(std::move(result), *rival, matches, options, regions) : std::move(result);
  }
  result = estimate_by_regions(matches, options, regions);
  if (result.geometry && is_contradicted(*result.geometry, matches, regions)) {
    return {TwoViewStatus::kAmbiguous, std::nullopt};
  }
  return result;
}

}  // namespace waymark
