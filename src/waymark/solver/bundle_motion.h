// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// What a sensor of motion measured between poses, in a bundle adjustment: unknowns besides poses
/// and points (velocities, biases, how the sensor is mounted), in blocks of six, and terms that tie
/// them to pairs of poses.
struct BundleMotion {
  /// Blocks of a term: two poses, as left perturbations, and unknowns, which add up.
  static constexpr std::size_t kNumPoses = 2, kNumUnknowns = 7;
  static constexpr std::size_t kNumBlocks = kNumPoses + kNumUnknowns;

  struct Term {
    std::array<std::uint32_t, kNumPoses> poses;  ///< In BundleProblem::rig_from_world.
    std::array<std::uint32_t, kNumUnknowns> unknowns;
  };
  /// What a term is off by, in standard deviations, and its derivatives by its blocks.
  struct Rows {
    Eigen::Matrix<double, 15, 1> residual;
    Eigen::Matrix<double, 15, 6 * kNumBlocks> by_blocks;
  };
  using Evaluate = std::function<Rows(std::size_t term,
                                      const std::array<Rigid3, kNumPoses>& poses,
                                      const std::array<Vector6d, kNumUnknowns>& unknowns)>;

  std::vector<Term> terms;
  Evaluate evaluate;               ///< Of a term, from several threads.
  std::vector<Vector6d> unknowns;  ///< Where to begin, and the result.
  /// What is believed of them; every component has some information.
  std::vector<Vector6d> prior, prior_information;
  /// What a standard deviation counts as in the residuals of bearings, which are in px.
  double noise_px = 1.0;

  /// Rows of a term where the poses and unknowns are these.
  Rows rows(std::size_t term,
            const std::vector<Rigid3>& rig_from_world,
            const std::vector<Vector6d>& values) const;
  /// Squared residuals of terms in standard deviations, for each row that they have.
  double mean_squared_residual(const std::vector<Rigid3>& rig_from_world) const;
};

}  // namespace waymark
