// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "waymark/image/image.h"

namespace waymark {

/// A grey image on a surface, with its mip levels (Williams 1983), addressed in metres.
class Texture {
 public:
  /// The image covers [0, width * texel_m) x [0, height * texel_m). With wraps_u its columns
  /// repeat.
  Texture(Image base, double texel_m, bool wraps_u);

  /// Mean grey over the parallelogram around centre_m with the edges edge_a_m and edge_b_m: the
  /// footprint of a pixel. Long footprints are read at several places along their longer edge, so
  /// that grazing views stay sharp (after Feline, McCormack et al. 1999).
  float sample(const Eigen::Vector2f& centre_m,
               const Eigen::Vector2f& edge_a_m,
               const Eigen::Vector2f& edge_b_m) const;

  /// Width of a texel of level 0.
  double texel_m() const { return texel_m_; }
  /// Of the whole image.
  double width_m() const { return texel_m_ * levels_.front().width_px; }
  /// Of the whole image.
  double height_m() const { return texel_m_ * levels_.front().height_px; }

 private:
  /// Places along a line, in texels of level 0.
  struct Probes {
    Eigen::Vector2f first;
    Eigen::Vector2f step;
    int count;
  };

  template <bool kWraps>
  float mean(int level, const Probes& probes) const;

  std::vector<Image> levels_;
  double texel_m_;
  float texels_per_metre_;
  bool wraps_u_;
};

}  // namespace waymark
