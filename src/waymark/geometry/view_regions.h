// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace waymark {

/// Bearings by where they look: those within about kSizeRad of each other are one region, which
/// shows one surface. Keeps its buffers.
class ViewRegions {
 public:
  static constexpr double kSizeRad = 0.1;
  /// Where all regions are to count alike, each has that many votes.
  static constexpr std::size_t kVotes = 4;

  /// Of unit bearings.
  template <class Scalar>
  void sort(std::span<const Eigen::Matrix<Scalar, 3, 1>> bearings) {
    members_.clear();
    for (std::uint32_t i = 0; i < bearings.size(); ++i) {
      members_.emplace_back(region_of(bearings[i].template cast<double>()), i);
    }
    std::ranges::sort(members_);
  }

  /// Calls visit(indices) with the bearings of each region, ascending.
  template <class Visit>
  void for_each(Visit&& visit) {
    for (std::size_t begin = 0, end = 0; begin < members_.size(); begin = end) {
      region_.clear();
      for (; end < members_.size() && members_[end].first == members_[begin].first; ++end) {
        region_.push_back(members_[end].second);
      }
      visit(std::span<const std::uint32_t>(region_));
    }
  }

  /// Up to kVotes bearings of each region, evenly from its list.
  std::vector<std::uint32_t> votes() {
    std::vector<std::uint32_t> chosen;
    for_each([&](std::span<const std::uint32_t> region) {
      const std::size_t count = std::min(region.size(), kVotes);
      for (std::size_t k = 0; k < count; ++k) chosen.push_back(region[k * region.size() / count]);
    });
    return chosen;
  }

 private:
  static std::uint32_t region_of(const Eigen::Vector3d& bearing) {
    constexpr int kPerAxis = static_cast<int>(2.0 / kSizeRad) + 2;
    const Eigen::Vector3i cell =
        ((bearing + Eigen::Vector3d::Ones()) / kSizeRad).array().floor().cast<int>();
    const auto clamped = cell.cwiseMax(0).cwiseMin(kPerAxis - 1);
    return static_cast<std::uint32_t>((clamped.x() * kPerAxis + clamped.y()) * kPerAxis +
                                      clamped.z());
  }

  std::vector<std::pair<std::uint32_t, std::uint32_t>> members_;  ///< Region and index, sorted.
  std::vector<std::uint32_t> region_;
};

/// How much regions of the view contradict what was fitted to all of it: the variance of their mean
/// errors over that of single errors (components of variance in a one-way layout, Searle et al.
/// 1992, 3.5). About 0 where errors are noise, whatever its size and number; what moves by itself
/// is off as a whole.
class Contradiction {
 public:
  /// Above this a part of the view moves by itself: where nothing does it is up to .6, for crowds
  /// from 1.5 on (docs/decisions.md).
  static constexpr double kMax = 1.0;

  /// Errors of one region, by their number, the squared length of their sum and the sum of their
  /// squared lengths. Of fewer than three nothing is learnt.
  void add(double count, double squared_sum, double sum_of_squares) {
    if (count < 3.0) return;
    between_ += squared_sum / count;
    within_ += sum_of_squares - squared_sum / count;
    num_regions_ += 1.0;
    num_errors_ += count;
    squared_counts_ += count * count;
  }

  double ratio() const {
    if (num_regions_ < 2.0 || !(within_ > 0.0)) return 0.0;
    const double noise = within_ / (num_errors_ - num_regions_);
    const double mean_count = (num_errors_ - squared_counts_ / num_errors_) / (num_regions_ - 1.0);
    return (between_ / num_regions_ / noise - 1.0) / mean_count;
  }

 private:
  double between_ = 0.0, within_ = 0.0;  ///< Sums of squares about 0 and about the means.
  double num_regions_ = 0.0, num_errors_ = 0.0, squared_counts_ = 0.0;
};

}  // namespace waymark
