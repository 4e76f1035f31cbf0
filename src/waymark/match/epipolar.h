// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/match/appearance.h"

namespace waymark {

struct EpipolarOptions {
  double max_error_px = 2.0;      ///< Distance from the epipolar curve, pixels of b's level.
  double min_parallax_px = 4.0;   ///< Smallest parallax, in pixels of the coarser level.
  double max_parallax_rad = 0.7;  ///< Largest parallax.
  AppearanceOptions appearance{.max_distance = 56, .max_ratio = 0.85};
};

/// Finds corners of two views of camera 0 that may show the same unknown point: alike, and on each
/// other's epipolar curve. Works on bearings, for any central camera: around the baseline as axis,
/// both bearings of a point have the same azimuth, and their angles to the axis differ by the
/// parallax. So the features of b are sorted by azimuth once and each feature of a meets a short
/// list. Keeps its buffers; results stay valid until the next call.
class EpipolarMatcher {
 public:
  /// Features with is_taken set are left out. b_from_a: of the cameras; its translation must not be
  /// zero.
  std::span<const FeatureMatch> match(const Features& a,
                                      std::span<const std::uint8_t> is_taken_a,
                                      const Features& b,
                                      std::span<const std::uint8_t> is_taken_b,
                                      const Rigid3& b_from_a,
                                      const EpipolarOptions& options);

 private:
  /// A bearing in coordinates around the baseline.
  struct Polar {
    float azimuth_rad;
    float axis_angle_rad;
    std::uint32_t feature;
  };

  void choose(const Polar& polar,
              const Features& a,
              const Features& b,
              const EpipolarOptions& options);

  std::vector<Polar> polar_b_;
  std::vector<std::uint32_t> candidates_;
  std::vector<std::uint16_t> distances_;
  std::vector<FeatureMatch> best_of_b_;
  std::vector<FeatureMatch> matches_;
};

}  // namespace waymark
