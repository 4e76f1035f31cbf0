// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "waymark/imu/imu.h"
#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_residual.h"
#include "waymark/imu/preintegration.h"

namespace waymark {

/// A state and how sure it is.
struct InertialEstimate {
  InertialState state;
  Matrix15d covariance = Matrix15d::Zero();  ///< Of its tangent vector.
};

/// Where the rig is at the end of a preintegration by what it was at its beginning. The covariance
/// is propagated to first order, with that of the noise and the walk of the biases; that of the
/// setup is not in it. The time shift of the setup must not have changed since the samples were
/// cut.
InertialEstimate predict(const InertialEstimate& first,
                         const Preintegration& preintegration,
                         const InertialSetup& setup);

/// The same through samples from begin_ns to end_ns (> begin_ns, by the clock of the IMU); nothing
/// where these do not tell all of it.
std::optional<InertialEstimate> predict(const InertialEstimate& first,
                                        const ImuSamples& samples,
                                        std::int64_t begin_ns,
                                        std::int64_t end_ns,
                                        const ImuNoise& noise,
                                        const InertialSetup& setup);

}  // namespace waymark
