// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/inertial_bundle.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/imu/inertial_path.h"
#include "waymark/imu/inertial_residual.h"
#include "waymark/imu/preintegration.h"

namespace waymark {
namespace {

/// What is not told beforehand, in rad and m/s.
constexpr double kGravitySigma = 1.0;
constexpr double kVelocitySigma = 100.0;
/// Biases of a keyframe are told by those beside it, rad/s and m/s^2.
constexpr double kGyroscopeBiasSigma = 10.0;
constexpr double kAccelerometerBiasSigma = 10.0;
/// What was found is no better known than this, in m, rad and s.
constexpr double kLeastLeverArmSigma = 1e-3;
constexpr double kLeastRotationSigma = 5e-4;
constexpr double kLeastTimeShiftSigma_s = 1e-4;
/// What data sheets of small IMUs state as three standard deviations is 1 %.
constexpr double kAxisScaleSigma = 0.004;
/// In recordings and simulated motions that agree the one is .1 to 2, the other at most 1.05.
constexpr double kMaxMeanSquare = 3.0;
constexpr double kMaxGrowth = 1.2;

/// The order of the unknowns; tangent vectors are split as said.
constexpr std::uint32_t kGravityAndShift = 0;  ///< Gravity 2, time shift 1, nothing.
constexpr std::uint32_t kMounting = 1;         ///< xi of imu_from_rig.
/// How much too large, as a part, axes of gyroscope 3 and accelerometer 3 measure.
constexpr std::uint32_t kAxisScales = 2;
/// Of keyframe i: velocity 3 and gyroscope bias 3; accelerometer bias 3, nothing.
constexpr std::uint32_t velocity_of(std::uint32_t i) { return 3 + 2 * i; }
constexpr std::uint32_t accelerometer_of(std::uint32_t i) { return 4 + 2 * i; }

void add_unknown(const Vector6d& start, const Vector6d& sigma, BundleMotion& motion) {
  motion.unknowns.push_back(start);
  motion.prior.push_back(start);
  motion.prior_information.push_back(sigma.cwiseAbs2().cwiseInverse());
}

void add_setup(const InertialStart& found, BundleMotion& motion) {
  const double shift_sigma = std::max(found.sigma(kTimeShiftAt), kLeastTimeShiftSigma_s);
  Vector6d sigma;
  sigma << kGravitySigma, kGravitySigma, shift_sigma, 1.0, 1.0, 1.0;
  add_unknown(Vector6d::Zero(), sigma, motion);
  const double lever_arm =
      std::max(largest_sigma(found.covariance(), kLeverArmAt), kLeastLeverArmSigma);
  const double rotation =
      std::max(largest_sigma(found.covariance(), kRotationAt), kLeastRotationSigma);
  sigma << Eigen::Vector3d::Constant(lever_arm), Eigen::Vector3d::Constant(rotation);
  add_unknown(Vector6d::Zero(), sigma, motion);
  add_unknown(Vector6d::Zero(), Vector6d::Constant(kAxisScaleSigma), motion);
}

/// Velocity by the keyframes before and after it.
Eigen::Vector3d velocity_at(const Map& map,
                            std::span<const KeyframeId> in_time,
                            std::size_t i,
                            double metres) {
  const Keyframe& before = map.keyframes().at(in_time[i == 0 ? 0 : i - 1]);
  const Keyframe& after = map.keyframes().at(in_time[std::min(i + 1, in_time.size() - 1)]);
  const double seconds = 1e-9 * static_cast<double>(after.timestamp_ns - before.timestamp_ns);
  if (!(seconds > 0.0)) return Eigen::Vector3d::Zero();
  return metres / seconds *
         (after.rig_from_world.origin_in_source() - before.rig_from_world.origin_in_source());
}

void add_states(const Map& map,
                std::span<const KeyframeId> in_time,
                const InertialStart& found,
                BundleMotion& motion) {
  const ImuBiases& biases = found.states.back().biases;
  for (std::size_t i = 0; i < in_time.size(); ++i) {
    Vector6d start, sigma;
    start << velocity_at(map, in_time, i, std::exp(found.setup.log_scale)), biases.gyroscope;
    sigma << Eigen::Vector3d::Constant(kVelocitySigma),
        Eigen::Vector3d::Constant(kGyroscopeBiasSigma);
    add_unknown(start, sigma, motion);
    start << biases.accelerometer, Eigen::Vector3d::Zero();
    sigma << Eigen::Vector3d::Constant(kAccelerometerBiasSigma), Eigen::Vector3d::Ones();
    add_unknown(start, sigma, motion);
  }
}

InertialState state_of(const Rigid3& rig_from_world,
                       const Vector6d& velocity_and_turn,
                       const Vector6d& accelerometer) {
  return {rig_from_world,
          velocity_and_turn.head<3>(),
          {velocity_and_turn.tail<3>(), accelerometer.head<3>()}};
}

BundleMotion::Rows rows_of(const Preintegration& measured,
                           const InertialSetup& found,
                           const std::array<Rigid3, BundleMotion::kNumPoses>& poses,
                           const std::array<Vector6d, BundleMotion::kNumUnknowns>& unknowns) {
  Vector10d change;
  change << unknowns[4].head<2>(), 0.0, unknowns[5], unknowns[4][2];
  const InertialResidual residual = inertial_residual(measured,
                                                      state_of(poses[0], unknowns[0], unknowns[1]),
                                                      state_of(poses[1], unknowns[2], unknowns[3]),
                                                      found.moved(change));
  const Eigen::Matrix<double, 15, 6> by_scales =
      -measured.square_root_information().leftCols<9>() * measured.by_scales();
  BundleMotion::Rows rows{residual.value + by_scales * unknowns[6], {}};
  const auto nothing = Eigen::Matrix<double, 15, 3>::Zero();
  rows.by_blocks << residual.by_first.leftCols<6>(), residual.by_second.leftCols<6>(),
      residual.by_first.rightCols<9>(), nothing, residual.by_second.rightCols<9>(), nothing,
      residual.by_setup.leftCols<2>(), residual.by_setup.col(9), nothing,
      residual.by_setup.middleCols<6>(3), by_scales;
  return rows;
}

}  // namespace

void add_inertial_terms(const Map& map,
                        std::span<const KeyframeId> keyframes,
                        const InertialEvidence& imu,
                        BundleProblem& problem) {
  std::vector<std::uint32_t> order(keyframes.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto time_of = [&](std::uint32_t i) {
    return map.keyframes().at(keyframes[i]).timestamp_ns;
  };
  std::ranges::stable_sort(order, {}, time_of);
  std::vector<KeyframeId> in_time;
  for (const std::uint32_t i : order) in_time.push_back(keyframes[i]);

  BundleMotion& motion = problem.motion.emplace();
  add_setup(imu.found, motion);
  add_states(map, in_time, imu.found, motion);
  const auto measured = std::make_shared<std::vector<Preintegration>>();
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * imu.found.time_shift_s));
  for (std::uint32_t i = 0; i + 1 < order.size(); ++i) {
    const std::int64_t begin_ns = time_of(order[i]), end_ns = time_of(order[i + 1]);
    if (end_ns <= begin_ns || end_ns - begin_ns > kMaxBridgedNs) continue;
    auto samples = imu.samples.between(begin_ns + shift_ns, end_ns + shift_ns);
    if (samples.empty()) continue;
    measured->emplace_back(std::move(samples), imu.noise, imu.found.states.back().biases);
    motion.terms.push_back({{order[i], order[i + 1]},
                            {velocity_of(i),
                             accelerometer_of(i),
                             velocity_of(i + 1),
                             accelerometer_of(i + 1),
                             kGravityAndShift,
                             kMounting,
                             kAxisScales}});
  }
  motion.evaluate = [measured, setup = imu.found.setup](
                        std::size_t term, const auto& poses, const auto& unknowns) {
    return rows_of((*measured)[term], setup, poses, unknowns);
  };
}

bool contradicts_imu(const BundleProblem& problem, const BundleResult& result) {
  return result.final_median_px > kMaxGrowth * result.initial_median_px ||
         problem.motion->mean_squared_residual(problem.rig_from_world) > kMaxMeanSquare;
}

}  // namespace waymark
