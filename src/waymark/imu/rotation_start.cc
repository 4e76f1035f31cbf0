// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "waymark/geometry/robust_loss.h"
#include "waymark/imu/start_steps.h"

namespace waymark {
namespace {

/// Poses further apart may be more than half a turn apart, and then show another one.
constexpr std::int64_t kMaxPairNs = 1'000'000'000;
constexpr int kRounds = 3;           ///< In which the bias is integrated with.
constexpr int kReweightings = 4;     ///< Of outliers among turns.
constexpr double kShiftStep = 0.01;  ///< s. Motion of a hand or vehicle is slower.
/// Shifts of up to so many standard deviations are tried.
constexpr double kMaxShiftSigmas = 3.0;
/// Errors of a turn in standard deviations, of three components, that count fully.
constexpr double kHuberTurn = 3.0;

/// How the IMU turned by its own account: imu_1_from_imu_2.
Eigen::Quaterniond turn_of(std::span<const ImuSample> samples, const Eigen::Vector3d& bias) {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const ImuSample& a = samples[i - 1];
    const ImuSample& b = samples[i];
    const double dt = 1e-9 * static_cast<double>(b.timestamp_ns - a.timestamp_ns);
    turn = turn * so3_exp(dt * (0.5 * (a.angular_velocity + b.angular_velocity) - bias));
  }
  return turn.normalized();
}

/// Mean angular velocities between neighbouring poses, each in its own frame, rad/s; a column each.
struct TurnRates {
  Eigen::Matrix3Xd of_rig;
  Eigen::Matrix3Xd of_imu;
  Eigen::VectorXd information;  ///< Of the difference, s^2/rad^2.
};

struct TurnFit {
  Eigen::Matrix3d imu_from_rig;
  Eigen::Vector3d bias;
  double cost = std::numeric_limits<double>::infinity();
};

TurnRates turn_rates(const StartProblem& problem, const Eigen::Vector3d& bias, double shift) {
  const auto most = static_cast<Eigen::Index>(problem.poses.size());
  TurnRates rates{Eigen::Matrix3Xd(3, most), Eigen::Matrix3Xd(3, most), Eigen::VectorXd(most)};
  Eigen::Index count = 0;
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * shift));
  for (std::size_t i = 1; i < problem.poses.size(); ++i) {
    const VisionPose& first = problem.poses[i - 1];
    const VisionPose& second = problem.poses[i];
    if (!first.is_seen || !second.is_seen) continue;
    if (second.timestamp_ns - first.timestamp_ns > kMaxPairNs) continue;
    const std::int64_t begin = first.timestamp_ns + shift_ns;
    const std::int64_t end = second.timestamp_ns + shift_ns;
    const std::vector<ImuSample> samples = problem.samples.between(begin, end);
    if (samples.empty()) continue;
    const double dt = 1e-9 * static_cast<double>(end - begin);
    rates.of_imu.col(count) = so3_log(turn_of(samples, bias)) / dt;
    rates.of_rig.col(count) =
        so3_log(first.rig_from_world.rotation * second.rig_from_world.rotation.conjugate()) / dt;
    const double gyroscope = problem.noise.gyroscope;
    const double pose = problem.options.pose_rotation_sigma;
    rates.information[count++] = dt * dt / (2.0 * pose * pose + dt * gyroscope * gyroscope);
  }
  return {
      rates.of_rig.leftCols(count), rates.of_imu.leftCols(count), rates.information.head(count)};
}

/// The rotation that aligns the rates without their means; where these do not tell it, it is the
/// one of those that explain them that turns least: 1 rad costs as much as one standard deviation.
Eigen::Matrix3d align_rates(const TurnRates& rates, const Eigen::VectorXd& weights) {
  const Eigen::Vector3d mean_rig = rates.of_rig * weights / weights.sum();
  const Eigen::Vector3d mean_imu = rates.of_imu * weights / weights.sum();
  const Eigen::Matrix3d product = (rates.of_imu.colwise() - mean_imu) * weights.asDiagonal() *
                                      (rates.of_rig.colwise() - mean_rig).transpose() +
                                  Eigen::Matrix3d::Identity();
  if (!product.allFinite()) return Eigen::Matrix3d::Identity();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV()).determinant() < 0.0) u.col(2) *= -1.0;
  return u * svd.matrixV().transpose();
}

/// known_bias is in the rates already; the fit's is what is left of it.
TurnFit fit_turns(const StartProblem& problem,
                  const TurnRates& rates,
                  const Eigen::Vector3d& known_bias) {
  TurnFit fit;
  const Eigen::Index count = rates.information.size();
  if (count == 0) return fit;
  const auto& told = problem.calibration.imu_from_rig;
  const double prior = std::pow(problem.options.gyroscope_bias_sigma, -2.0);
  Eigen::VectorXd weights = rates.information;
  for (int round = 0; round < kReweightings; ++round) {
    fit.imu_from_rig = told ? told->rotation_matrix() : align_rates(rates, weights);
    const Eigen::Matrix3Xd differences = rates.of_imu - fit.imu_from_rig * rates.of_rig;
    fit.bias = (differences * weights - prior * known_bias) / (weights.sum() + prior);
    fit.cost = 0.0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const double information = rates.information[i];
      const RobustValue robust =
          huber(information * (differences.col(i) - fit.bias).squaredNorm(), kHuberTurn);
      fit.cost += robust.loss;
      weights[i] = robust.weight * information;
    }
  }
  // Poses at the ends may have no samples with some shifts.
  fit.cost *= static_cast<double>(problem.poses.size() - 1) / static_cast<double>(count);
  return fit;
}

/// The time shift of the least cost: on a grid, then by the parabola through it and its neighbours.
double best_time_shift(const StartProblem& problem, const Eigen::Vector3d& bias) {
  const double sigma = problem.options.time_shift_sigma_s;
  const auto cost = [&](int i) {
    const double shift = i * kShiftStep;
    return fit_turns(problem, turn_rates(problem, bias, shift), bias).cost +
           shift * shift / (sigma * sigma);
  };
  const int most = static_cast<int>(std::ceil(kMaxShiftSigmas * sigma / kShiftStep));
  std::vector<double> costs;
  for (int i = -most; i <= most; ++i) costs.push_back(cost(i));
  const auto best = std::ranges::min_element(costs);
  const auto index = static_cast<int>(best - costs.begin());
  double offset = 0.0;
  if (index > 0 && index < 2 * most && std::isfinite(best[-1]) && std::isfinite(best[1])) {
    const double curvature = best[-1] - 2.0 * best[0] + best[1];
    if (curvature > 0.0) offset = 0.5 * (best[-1] - best[1]) / curvature;
  }
  return (index - most + offset) * kShiftStep;
}

}  // namespace

std::optional<RotationStart> rotation_start(const StartProblem& problem) {
  if (problem.samples.all().empty() || problem.poses.size() < 2) return std::nullopt;
  RotationStart start;
  for (int round = 0; round < kRounds; ++round) {
    const auto& told_shift = problem.calibration.time_shift_s;
    start.time_shift_s = told_shift ? *told_shift : best_time_shift(problem, start.gyroscope_bias);
    const TurnFit fit = fit_turns(problem,
                                  turn_rates(problem, start.gyroscope_bias, start.time_shift_s),
                                  start.gyroscope_bias);
    if (!std::isfinite(fit.cost)) return std::nullopt;
    start.imu_from_rig = Eigen::Quaterniond(fit.imu_from_rig).normalized();
    start.gyroscope_bias += fit.bias;
  }
  return start;
}

}  // namespace waymark
