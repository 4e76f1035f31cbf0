// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/two_view_models.h"

#include <array>

#include "waymark/geometry/alignment.h"
#include "waymark/geometry/bearing.h"
#include "waymark/geometry/essential.h"
#include "waymark/geometry/homography.h"
#include "waymark/geometry/relative_pose.h"

namespace waymark {
namespace {

template <std::size_t kSize>
std::array<Eigen::Vector3d, kSize> gather(std::span<const Eigen::Vector3d> bearings,
                                          std::span<const std::uint32_t, kSize> sample) {
  std::array<Eigen::Vector3d, kSize> result;
  for (std::size_t i = 0; i < kSize; ++i) result[i] = bearings[sample[i]];
  return result;
}

// Every k-th of the indices such that about this many remain: local optimisation needs no more to
// find the right basin (Lebeda, Matas & Chum 2012, Fixing the Locally Optimized RANSAC).
std::vector<std::uint32_t> thin_out(std::span<const std::uint32_t> indices) {
  constexpr std::size_t kEnough = 300;
  const std::size_t stride = (indices.size() + kEnough - 1) / kEnough;
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < indices.size(); i += stride) result.push_back(indices[i]);
  return result;
}

}  // namespace

std::vector<Eigen::Matrix3d> EssentialEstimator::fit(
    std::span<const std::uint32_t, kSampleSize> sample) const {
  const auto bearings_a = gather(matches_.bearings_a, sample);
  const auto bearings_b = gather(matches_.bearings_b, sample);
  return solve_five_point(bearings_a, bearings_b);
}

double EssentialEstimator::squared_error(const Eigen::Matrix3d& essential,
                                         std::size_t index) const {
  return squared_epipolar_error(essential, matches_, index);
}

std::optional<Eigen::Matrix3d> EssentialEstimator::refine(
    const Eigen::Matrix3d& essential, std::span<const std::uint32_t> nearby) const {
  if (nearby.size() <= kSampleSize) return std::nullopt;
  // The epipolar error is the same for all four poses of an essential matrix.
  const Rigid3 b_from_a = decompose_essential(essential).front();
  return essential_from_pose(
      refine_relative_pose(b_from_a, matches_, thin_out(nearby), {.max_iterations = 6}));
}

std::vector<Eigen::Matrix3d> HomographyEstimator::fit(
    std::span<const std::uint32_t, kSampleSize> sample) const {
  const auto bearings_a = gather(matches_.bearings_a, sample);
  const auto bearings_b = gather(matches_.bearings_b, sample);
  const std::optional<Eigen::Matrix3d> homography = solve_four_point(bearings_a, bearings_b);
  if (!homography) return {};
  return {*homography};
}

double HomographyEstimator::squared_error(const Eigen::Matrix3d& homography,
                                          std::size_t index) const {
  return squared_homography_error(homography, matches_, index);
}

std::optional<Eigen::Matrix3d> HomographyEstimator::refine(
    const Eigen::Matrix3d& homography, std::span<const std::uint32_t> nearby) const {
  return refine_homography(homography, matches_, thin_out(nearby));
}

std::vector<Eigen::Matrix3d> RotationEstimator::fit(
    std::span<const std::uint32_t, kSampleSize> sample) const {
  const auto bearings_a = gather(matches_.bearings_a, sample);
  const auto bearings_b = gather(matches_.bearings_b, sample);
  const std::optional<Eigen::Matrix3d> rotation = align_directions(bearings_a, bearings_b);
  if (!rotation) return {};
  return {*rotation};
}

double RotationEstimator::squared_error(const Eigen::Matrix3d& rotation, std::size_t index) const {
  return (rotation * matches_.bearings_a[index] - matches_.bearings_b[index]).squaredNorm() /
         variance(index);
}

std::optional<Eigen::Matrix3d> RotationEstimator::refine(
    const Eigen::Matrix3d& rotation, std::span<const std::uint32_t> nearby) const {
  std::vector<Eigen::Vector3d> directions_a, directions_b;
  std::vector<double> weights;
  for (const std::uint32_t index : nearby) {
    directions_a.push_back(matches_.bearings_a[index]);
    directions_b.push_back(matches_.bearings_b[index]);
    weights.push_back(geman_mcclure_weight(squared_error(rotation, index), kMaxSquaredError) /
                      variance(index));
  }
  return align_directions(directions_a, directions_b, weights);
}

double RotationEstimator::variance(std::size_t index) const {
  return matches_.sigmas_rad_a[index] * matches_.sigmas_rad_a[index] +
         matches_.sigmas_rad_b[index] * matches_.sigmas_rad_b[index];
}

}  // namespace waymark
