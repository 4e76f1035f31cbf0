// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/features/features.h"
#include "waymark/match/nearest.h"

namespace waymark {

/// Two features that look alike.
struct FeatureMatch {
  std::uint32_t a = kNoFeature;
  std::uint32_t b = kNoFeature;
  std::uint16_t distance = 0;  ///< Hamming.
};

/// Matches corners of camera 0 by descriptor alone, or within a window of the image. One to one.
/// Matches whose change of orientation disagrees with the rest are dropped (Hough voting, Lowe
/// 2004, 7.3). Keeps its buffers; results stay valid until the next call.
class AppearanceMatcher {
 public:
  /// Each of the features indices_a of a against all features of b.
  std::span<const FeatureMatch> match_all(const Features& a,
                                          std::span<const std::uint32_t> indices_a,
                                          const Features& b,
                                          const AppearanceOptions& options);

  /// Feature i of a is looked for in b within radius_px (level-0 pixels) of expected_pixels[i].
  std::span<const FeatureMatch> match_near(const Features& a,
                                           std::span<const Eigen::Vector2f> expected_pixels,
                                           double radius_px,
                                           const Features& b,
                                           const AppearanceOptions& options);

 private:
  void begin(const Features& b);
  void choose(std::uint32_t index_a,
              const Features& a,
              const Features& b,
              const AppearanceOptions& options);
  std::span<const FeatureMatch> finish(const Features& a, const Features& b);

  std::vector<std::uint32_t> candidates_;
  std::vector<std::uint16_t> distances_;
  std::vector<FeatureMatch> best_of_b_;
  std::vector<FeatureMatch> matches_;
};

}  // namespace waymark
