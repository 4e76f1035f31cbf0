// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_prediction.h"

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Where a delta leads from a state (Forster et al. 2017, eq. 33, solved for the second state).
InertialState state_after(const InertialState& first,
                          const Preintegration& preintegration,
                          const InertialSetup& setup) {
  const double t = preintegration.duration_s();
  const InertialDelta delta = preintegration.delta_with(first.biases);
  const Rigid3 begin = world_from_imu(first, setup);
  const Rigid3 end((begin.rotation * delta.rotation).normalized(),
                   begin.translation + t * first.velocity + 0.5 * t * t * setup.gravity +
                       begin.rotation * delta.position);
  InertialState second = first;
  second.velocity += t * setup.gravity + begin.rotation * delta.velocity;
  second.rig_from_world = (end * setup.imu_from_rig).inverse();
  second.rig_from_world.translation *= std::exp(-setup.log_scale);
  return second;
}

}  // namespace

std::optional<InertialEstimate> predict(const InertialEstimate& first,
                                        const ImuSamples& samples,
                                        std::int64_t begin_ns,
                                        std::int64_t end_ns,
                                        const ImuNoise& noise,
                                        const InertialSetup& setup) {
  WAYMARK_CHECK(setup.time_shift_change_s == 0.0);
  std::vector<ImuSample> between = samples.between(begin_ns, end_ns);
  if (between.empty()) return std::nullopt;
  const Preintegration measured(std::move(between), noise, first.state.biases);
  InertialEstimate second;
  second.state = state_after(first.state, measured, setup);
  // The whitened residual of both has unit covariance: by_first * e_1 + by_second * e_2 = n.
  const InertialResidual residual = inertial_residual(measured, first.state, second.state, setup);
  const Matrix15d inverse = residual.by_second.inverse();
  const Matrix15d by_first = inverse * residual.by_first;
  second.covariance =
      by_first * first.covariance * by_first.transpose() + inverse * inverse.transpose();
  return second;
}

}  // namespace waymark
