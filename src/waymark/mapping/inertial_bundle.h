// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_start.h"
#include "waymark/map/map.h"
#include "waymark/optimize/bundle.h"
#include "waymark/solver/bundle_problem.h"

namespace waymark {

/// What an IMU measured, and what is known of it in the frame of a sub-map.
struct InertialEvidence {
  const ImuSamples& samples;
  const ImuNoise& noise;
  const InertialStart& found;
};

/// Adds the terms that the samples between neighbouring keyframes give (preintegrated: Forster et
/// al. 2017), with velocity and biases of each keyframe, gravity, mounting and time shift as
/// unknowns; metres per map unit remain as found. keyframes: those of the problem, in its order.
void add_inertial_terms(const Map& map,
                        std::span<const KeyframeId> keyframes,
                        const InertialEvidence& imu,
                        BundleProblem& problem);

/// Whether the images contradict the samples where the adjustment ended: squared residuals of
/// samples are more than 3 in the mean (.4 expected, as each keyframe has nine unknowns of its own
/// for 15 of them), or those of bearings larger than before by a fifth, in px.
bool contradicts_imu(const BundleProblem& problem, const BundleResult& result);

}  // namespace waymark
