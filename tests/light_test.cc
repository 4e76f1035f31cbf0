// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Sudden changes of exposure and dark, noisy images do not stop tracking.
#include <gtest/gtest.h>

#include "simulated_run.h"

namespace waymark {
namespace {

constexpr int kNumLightFrames = 240;

/// Four steps of the exposure from x1/6 to x3, then two seconds in the dark with strong noise.
SequenceSpec changing_light() {
  SequenceSpec spec = small_sequence(Setup::kStereo, kNumLightFrames);
  const auto at_gain = [&spec](double gain, double noise_sigma) {
    ImageEffects effects = spec.effects;
    effects.gain = gain;
    effects.noise_sigma = noise_sigma;
    return effects;
  };
  const double noise = spec.effects.noise_sigma;
  spec.spans = {{40, 70, at_gain(0.5, noise)},
                {70, 100, at_gain(3.0, noise)},
                {100, 130, at_gain(1.0 / 6.0, noise)},
                {130, 150, at_gain(1.5, noise)},
                {170, 210, at_gain(1.0 / 6.0, 3.0 * noise)}};
  return spec;
}

TEST(Light, StepsOfExposureAndDarknessAreSurvived) {
  const Recording recording = simulate(changing_light());
  const SessionResults results = map_recording(recording, Timing::kLockstep);
  EXPECT_GE(coverage(results), 0.97);
  EXPECT_LT(evaluate_results(results, recording).ate_m.rmse, 0.05);
}

}  // namespace
}  // namespace waymark
