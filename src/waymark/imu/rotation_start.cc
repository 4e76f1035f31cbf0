// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/geometry/alignment.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/imu/start_steps.h"

namespace waymark {
namespace {

constexpr int kRounds = 3;           ///< In which the bias is integrated with.
constexpr int kReweightings = 4;     ///< Of outliers among turns.
constexpr double kShiftStep = 0.01;  ///< s. Motion of a hand or vehicle is slower.
/// Shifts of up to so many standard deviations are tried.
constexpr double kMaxShiftSigmas = 3.0;
/// Errors of a turn in standard deviations, of three components, that count fully.
constexpr double kHuberTurn = 3.0;

/// How the IMU is turned at any time by its own account.
class OrientationTrack {
 public:
  OrientationTrack(std::span<const ImuSample> samples, const Eigen::Vector3d& bias)
      : samples_(samples), bias_(bias), orientations_(samples.size()) {
    orientations_[0].setIdentity();
    for (std::size_t i = 1; i < samples.size(); ++i) {
      orientations_[i] = turned(i - 1, samples[i]).normalized();
    }
  }
  Eigen::Quaterniond at(const ImuSamples& samples, std::int64_t timestamp_ns) const {
    const auto after =
        std::ranges::upper_bound(samples_, timestamp_ns, {}, &ImuSample::timestamp_ns);
    return turned(static_cast<std::size_t>(after - samples_.begin()) - 1,
                  *samples.at(timestamp_ns));
  }

 private:
  Eigen::Quaterniond turned(std::size_t from, const ImuSample& to) const {
    const ImuSample& begin = samples_[from];
    const double dt = 1e-9 * static_cast<double>(to.timestamp_ns - begin.timestamp_ns);
    return orientations_[from] *
           so3_exp(dt * (0.5 * (begin.angular_velocity + to.angular_velocity) - bias_));
  }

  std::span<const ImuSample> samples_;
  Eigen::Vector3d bias_;
  std::vector<Eigen::Quaterniond> orientations_;
};

/// Mean angular velocities between neighbouring poses, each in its own frame, rad/s.
struct TurnRates {
  std::vector<Eigen::Vector3d> of_rig;
  std::vector<Eigen::Vector3d> of_imu;
  std::vector<double> information;  ///< Of the difference, s^2/rad^2.
};

struct TurnFit {
  Eigen::Matrix3d imu_from_rig;
  Eigen::Vector3d bias;
  double cost = std::numeric_limits<double>::infinity();
};

TurnRates turn_rates(const StartProblem& problem, const OrientationTrack& track, double shift) {
  TurnRates rates;
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * shift));
  for (std::size_t i = 1; i < problem.poses.size(); ++i) {
    const VisionPose& first = problem.poses[i - 1];
    const VisionPose& second = problem.poses[i];
    const std::int64_t begin = first.timestamp_ns + shift_ns;
    const std::int64_t end = second.timestamp_ns + shift_ns;
    if (problem.samples.coverage(begin, end) != ImuCoverage::kWhole) continue;
    const double dt = 1e-9 * static_cast<double>(end - begin);
    const auto imu = track.at(problem.samples, begin).conjugate() * track.at(problem.samples, end);
    const auto rig = first.rig_from_world.rotation * second.rig_from_world.rotation.conjugate();
    rates.of_imu.push_back(so3_log(imu) / dt);
    rates.of_rig.push_back(so3_log(rig) / dt);
    const double gyroscope = problem.noise.gyroscope;
    const double pose = problem.options.pose_rotation_sigma;
    rates.information.push_back(dt * dt / (2.0 * pose * pose + dt * gyroscope * gyroscope));
  }
  return rates;
}

/// The rotation that aligns the rates without their means; where these do not tell it, it is the
/// one of those that explain them that turns least.
Eigen::Matrix3d align_rates(const TurnRates& rates, std::span<const double> weights) {
  double sum = 0.0;
  Eigen::Vector3d mean_rig = Eigen::Vector3d::Zero(), mean_imu = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sum += weights[i];
    mean_rig += weights[i] * rates.of_rig[i];
    mean_imu += weights[i] * rates.of_imu[i];
  }
  std::vector<Eigen::Vector3d> rig, imu;
  std::vector<double> all(weights.begin(), weights.end());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    rig.push_back(rates.of_rig[i] - mean_rig / sum);
    imu.push_back(rates.of_imu[i] - mean_imu / sum);
  }
  for (int i = 0; i < 3; ++i) {  // A rotation of 1 rad costs as much as one standard deviation.
    rig.push_back(Eigen::Vector3d::Unit(i));
    imu.push_back(Eigen::Vector3d::Unit(i));
    all.push_back(1.0);
  }
  return align_directions(rig, imu, all).value_or(Eigen::Matrix3d::Identity());
}

/// known_bias is in the rates already; the fit's is what is left of it.
TurnFit fit_turns(const StartProblem& problem,
                  const TurnRates& rates,
                  const Eigen::Vector3d& known_bias) {
  TurnFit fit;
  if (rates.of_rig.empty()) return fit;
  const auto& told = problem.calibration.imu_from_rig;
  const double prior = std::pow(problem.options.gyroscope_bias_sigma, -2.0);
  std::vector<double> weights = rates.information;
  for (int round = 0; round < kReweightings; ++round) {
    fit.imu_from_rig = told ? told->rotation_matrix() : align_rates(rates, weights);
    double sum = prior;
    fit.bias = -prior * known_bias;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      sum += weights[i];
      fit.bias += weights[i] * (rates.of_imu[i] - fit.imu_from_rig * rates.of_rig[i]);
    }
    fit.bias /= sum;
    fit.cost = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const Eigen::Vector3d error = rates.of_imu[i] - fit.imu_from_rig * rates.of_rig[i] - fit.bias;
      const RobustValue robust = huber(rates.information[i] * error.squaredNorm(), kHuberTurn);
      fit.cost += robust.loss;
      weights[i] = robust.weight * rates.information[i];
    }
  }
  // Poses at the ends may have no samples with some shifts.
  fit.cost *= static_cast<double>(problem.poses.size() - 1) / static_cast<double>(weights.size());
  return fit;
}

/// The time shift of the least cost: on a grid, then by the parabola through it and its neighbours.
double best_time_shift(const StartProblem& problem,
                       const OrientationTrack& track,
                       const Eigen::Vector3d& bias) {
  const double sigma = problem.options.time_shift_sigma_s;
  const auto cost = [&](int i) {
    const double shift = i * kShiftStep;
    return fit_turns(problem, turn_rates(problem, track, shift), bias).cost +
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
    const OrientationTrack track(problem.samples.all(), start.gyroscope_bias);
    const auto& told_shift = problem.calibration.time_shift_s;
    start.time_shift_s =
        told_shift ? *told_shift : best_time_shift(problem, track, start.gyroscope_bias);
    const TurnFit fit =
        fit_turns(problem, turn_rates(problem, track, start.time_shift_s), start.gyroscope_bias);
    if (!std::isfinite(fit.cost)) return std::nullopt;
    start.imu_from_rig = Eigen::Quaterniond(fit.imu_from_rig).normalized();
    start.gyroscope_bias += fit.bias;
  }
  return start;
}

}  // namespace waymark
