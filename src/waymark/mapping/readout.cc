// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/readout.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/image/rolling_shutter.h"

namespace waymark {
namespace {

/// As for other numbers of a calibration: see docs/decisions.md.
constexpr double kMinReadoutSigmas = 7.0;
constexpr double kMinReadoutChange = 2.0;
/// Where none was given, shorter ones and those from the bottom up are taken for other errors:
/// rectified images of cars on the road look like -7 ms (docs/decisions.md).
constexpr double kMinReadoutS = 7.5e-3;
/// No camera needs longer for its rows.
constexpr double kMaxReadoutS = 0.1;
constexpr int kNumPasses = 3;

/// What a bearing of the rig's was moved by per second of readout, per observation.
std::vector<Eigen::Vector3f> bearings_by_readout(const Map& map,
                                                 std::span<const Observation> observed,
                                                 const Rig& rig,
                                                 const BundleProblem& problem) {
  std::vector<Eigen::Vector3f> all(observed.size(), Eigen::Vector3f::Zero());
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (problem.rigs[problem.observations[i].pose] != &rig) continue;
    const Keyframe& keyframe = map.keyframes().at(observed[i].keyframe);
    const Features& features = *keyframe.features;
    const std::uint32_t feature = observed[i].feature;
    const Keypoint& keypoint = features.keypoints[feature];
    const RigCamera& camera = rig.cameras[keypoint.camera];
    all[i] = row_delay(*camera.camera, keypoint.y_px) *
             bearing_rate(keyframe.motion, camera, features, feature);
  }
  return all;
}

struct ReadoutTrial {
  double readout_s = 0.0;
  double sigma_s = 0.0;
};

/// As the spread of what parts of the way tell has it, where that is more than noise explains.
double standard_deviation(const CalibrationEvidence& evidence, double noise_px) {
  const double information = evidence.information(0, 0);
  const double variance = std::max(noise_px * noise_px / information,
                                   evidence.scatter(0, 0) / (information * information));
  return std::sqrt(variance);
}

/// One adjustment from the readout reached; whether there is one.
bool adjust_readout(const std::vector<Eigen::Vector3f>& by_readout,
                    const Rig& rig,
                    double given_s,
                    BundleProblem& problem,
                    ReadoutTrial& trial) {
  BundleCalibration calibration;
  calibration.rig = &rig;
  calibration.blocks.assign(rig.cameras.size(), {0, 1, false});
  for (std::size_t i = 0; i < by_readout.size(); ++i) {
    calibration.first_derivative.push_back(2 * i);
    const Eigen::Vector2f derivative =
        problem.observations[i].level_pixel_from_bearing * by_readout[i];
    for (const float by : derivative) calibration.level_pixel_by_intrinsics.push_back(by);
  }
  calibration.prior_information.setConstant(1, 1, 1.0 / (kReadoutPriorS * kReadoutPriorS));
  calibration.prior_change.setConstant(1, given_s - trial.readout_s);
  calibration.change.setZero(1);
  problem.calibration = std::move(calibration);
  const BundleResult result =
      adjust_bundle(problem, {.num_rounds = 2, .max_iterations_per_round = 4});
  const BundleCalibration found = *std::exchange(problem.calibration, std::nullopt);
  if (found.evidence.information.size() == 0) return false;
  const double change_s = found.change[0];
  trial.readout_s += change_s;
  trial.sigma_s = standard_deviation(found.evidence, result.noise_px);
  if (!(std::abs(trial.readout_s) < kMaxReadoutS)) return false;
  for (std::size_t i = 0; i < by_readout.size(); ++i) {
    problem.observations[i].bearing -= static_cast<float>(change_s) * by_readout[i];
  }
  return true;
}

std::shared_ptr<const Rig> with_readout(const Rig& rig, double readout_s) {
  auto changed = std::make_shared<Rig>(rig);
  for (RigCamera& camera : changed->cameras) camera.readout_s = readout_s;
  return changed;
}

}  // namespace

std::optional<KnownCalibration> find_readout(const Map& map,
                                             std::span<const Observation> observed,
                                             const KnownCalibration& known,
                                             BundleProblem& problem) {
  const double given_s = known.given_readout_s;
  const double used_s = known.rig->cameras[0].readout_s;
  const auto by_readout = bearings_by_readout(map, observed, *known.rig, problem);
  if (std::ranges::all_of(by_readout, [](const auto& by) { return by.isZero(0.0f); })) {
    return std::nullopt;
  }
  BundleProblem adjusted = problem;
  ReadoutTrial trial{used_s, 0.0};
  for (int pass = 0; pass < kNumPasses; ++pass) {
    if (!adjust_readout(by_readout, *known.rig, given_s, adjusted, trial)) {
      return std::nullopt;
    }
    if (given_s == 0.0 && trial.readout_s < 0.5 * kMinReadoutS) return std::nullopt;
  }
  if (given_s == 0.0 && trial.readout_s < kMinReadoutS) return std::nullopt;
  if (std::abs(trial.readout_s - given_s) < kMinReadoutSigmas * trial.sigma_s) return std::nullopt;
  if (std::abs(trial.readout_s - used_s) < kMinReadoutChange * trial.sigma_s) return std::nullopt;
  KnownCalibration found = known;
  found.given = with_readout(*known.given, trial.readout_s);
  found.rig = with_readout(*known.rig, trial.readout_s);
  found.readout_sigma_s = trial.sigma_s;
  for (const Rig*& rig : adjusted.rigs) {
    if (rig == known.rig.get()) rig = found.rig.get();
  }
  problem = std::move(adjusted);
  return found;
}

}  // namespace waymark
