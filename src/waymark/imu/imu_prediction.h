// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_residual.h"

namespace waymark {

/// A state and how sure it is.
struct InertialEstimate {
  InertialState state;
  Matrix15d covariance = Matrix15d::Zero();  ///< Of its tangent vector.
};

/// Where the rig is at end_ns by what it was at begin_ns (< end_ns, by the clock of the IMU, which
/// the setup does not change) and the samples between; nothing where these do not tell all of it.
/// The covariance is propagated to first order, with the noise and the walk of the biases; that of
/// the setup is not in it.
std::optional<InertialEstimate> predict(const InertialEstimate& first,
                                        const ImuSamples& samples,
                                        std::int64_t begin_ns,
                                        std::int64_t end_ns,
                                        const ImuNoise& noise,
                                        const InertialSetup& setup);

}  // namespace waymark
