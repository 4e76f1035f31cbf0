// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/base/rng.h"
#include "waymark/image/image.h"

namespace waymark {

/// What a sensor does to a perfect image.
struct ImageEffects {
  double gain = 1.0;         ///< Exposure; bright parts saturate at 255.
  double noise_sigma = 0.0;  ///< Of the grey value, after the gain.
  /// Time the shutter is open, centred on the frame's time; what moves meanwhile blurs.
  double exposure_s = 0.0;
  double inverse_depth_sigma = 0.0;  ///< Of the depth image, in 1/m, as of disparity.
};

/// Applies gain and noise. Noise is the sum of eight uniform numbers, which is normal to within
/// 4.9 sigma.
void apply_exposure(const ImageEffects& effects, Rng& rng, Image& image);

/// Adds noise to the inverse depth; what leaves the 16 bits becomes 0.
void apply_depth_noise(const ImageEffects& effects,
                       double units_per_metre,
                       Rng& rng,
                       DepthImage& depth);

}  // namespace waymark
