// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/readout.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/features/rolling_shutter.h"
#include "waymark/mapping/camera_measurements.h"
#include "waymark/mapping/linear_calibration.h"

namespace waymark {
namespace {

/// As for other numbers of a calibration: see docs/decisions/calibrate.md.
constexpr double kMinReadoutSigmas = 7.0;
constexpr double kMinReadoutChange = 2.0;
/// Where none was given, shorter ones and those from the bottom up are taken for other errors:
/// rectified images of cars on the road look like -7 ms (docs/decisions/calibrate.md).
constexpr double kMinReadoutS = 7.5e-3;
/// No camera needs longer for its rows.
constexpr double kMaxReadoutS = 0.1;

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

std::shared_ptr<const Rig> with_readout(const Rig& rig, double readout_s) {
  auto changed = std::make_shared<Rig>(rig);
  for (RigCamera& camera : changed->cameras) camera.readout_s = readout_s;
  return changed;
}

LinearCalibration readout_of(const KnownCalibration& known,
                             const std::vector<Eigen::Vector3f>& by_readout,
                             const BundleProblem& problem) {
  LinearCalibration readout{.given = Eigen::VectorXd::Constant(1, known.given_readout_s),
                            .prior_sigma = Eigen::VectorXd::Constant(1, kReadoutPriorS),
                            .value = Eigen::VectorXd::Constant(1, known.rig->cameras[0].readout_s)};
  for (std::size_t i = 0; i < by_readout.size(); ++i) {
    const Eigen::Vector2f by = problem.observations[i].level_pixel_from_bearing * by_readout[i];
    readout.level_pixel_by.insert(readout.level_pixel_by.end(), by.begin(), by.end());
  }
  return readout;
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
  LinearCalibration readout = readout_of(known, by_readout, problem);
  if (!may_be_contradicted(*known.rig, adjusted, readout, kMinReadoutSigmas)) return std::nullopt;
  constexpr int kNumPasses = 3;
  for (int pass = 0; pass < kNumPasses; ++pass) {
    const auto change = adjust_linear(*known.rig, adjusted, readout);
    if (!change || !(std::abs(readout.value[0]) < kMaxReadoutS)) return std::nullopt;
    if (given_s == 0.0 && readout.value[0] < 0.5 * kMinReadoutS) return std::nullopt;
    for (std::size_t i = 0; i < by_readout.size(); ++i) {
      adjusted.observations[i].bearing -= static_cast<float>((*change)[0]) * by_readout[i];
    }
  }
  const double readout_s = readout.value[0], sigma_s = readout.sigma[0];
  if (given_s == 0.0 && readout_s < kMinReadoutS) return std::nullopt;
  if (std::abs(readout_s - given_s) < kMinReadoutSigmas * sigma_s) return std::nullopt;
  if (std::abs(readout_s - used_s) < kMinReadoutChange * sigma_s) return std::nullopt;
  KnownCalibration found = known;
  found.given = with_readout(*known.given, readout_s);
  found.rig = with_readout(*known.rig, readout_s);
  found.readout_sigma_s = sigma_s;
  use_rig(*known.rig, *found.rig, adjusted);
  problem = std::move(adjusted);
  return found;
}

}  // namespace waymark
