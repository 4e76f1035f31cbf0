// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/calibrate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "waymark/mapping/camera_measurements.h"
#include "waymark/solver/residual.h"

namespace waymark {
namespace {

/// The intrinsics act linearly in an adjustment: it is repeated until they move no more.
constexpr int kMaxPasses = 15;
/// An estimate so many standard deviations from what was given is no chance: of exact calibrations
/// the estimates scatter by 1.5, and the worst of twenty parameters by up to 5
/// (docs/decisions/calibrate.md).
constexpr double kMinSigmas = 7.0;
/// Parts of a way with fewer keyframes share most of what they see, err alike, and scatter by less
/// than they err, in the ratio of the numbers.
constexpr double kManyKeyframes = 30.0;
/// A calibration is replaced by one that differs by this many.
constexpr double kMinChange = 2.0;
/// Where the parts of the way contradict each other by this much more than corners scatter, what is
/// wrong is not the calibration: a rolling shutter, a stabilised video.
constexpr double kMaxDisagreement = 6.0;
/// By less than this part of its standard deviation.
constexpr double kStill = 0.1;
/// What is below this part of what is asked for, and moves by less than is left, will stay there.
constexpr double kPlainly = 0.5;
/// More tell hardly more, and take longer.
constexpr std::size_t kMaxObservations = 12000;

/// Appends the derivatives of the pixels of a camera's observations by its intrinsics.
bool add_derivatives(const CalibrationParameters& parameters,
                     std::size_t camera,
                     const Eigen::VectorXd& change,
                     const CameraMeasurements& measured,
                     const std::vector<Eigen::Vector3d>& directions,
                     BundleCalibration& calibration) {
  const auto derivatives = parameters.pixel_by_intrinsics(camera, change, directions);
  if (!derivatives) return false;
  const std::size_t stride = 2 * parameters.blocks()[camera].num_intrinsics;
  std::vector<float>& all = calibration.level_pixel_by_intrinsics;
  for (std::size_t k = 0; k < measured.indices.size(); ++k) {
    calibration.first_derivative[measured.indices[k]] = all.size();
    for (std::size_t j = k * stride; j < (k + 1) * stride; j += 2) {
      const Eigen::Vector2d by((*derivatives)[j], (*derivatives)[j + 1]);
      const Eigen::Vector2f counted = (measured.projectors[k] * by).cast<float>();
      all.push_back(counted.x() / measured.level_scales[k]);
      all.push_back(counted.y() / measured.level_scales[k]);
    }
  }
  return true;
}

/// A calibration that is being adjusted.
struct Trial {
  std::shared_ptr<const Rig> rig;
  Eigen::VectorXd change;
  Eigen::VectorXd sigma;
  /// Of a residual's component, in px^2, by what the parts of the way disagree: more than its
  /// noise, since errors that last count only once.
  double variance = 1.0;
  double noise_px = 1.0;  ///< Of a residual's component.
};

/// Standard deviations from what an adjustment with this prior told, and the variance of residuals
/// that they follow from.
void judge(const CalibrationEvidence& evidence,
           const Eigen::MatrixXd& prior_information,
           Trial& trial) {
  const Eigen::MatrixXd covariance = evidence.information.ldlt().solve(
      Eigen::MatrixXd::Identity(evidence.information.rows(), evidence.information.cols()));
  const Eigen::MatrixXd of_residuals = evidence.information - trial.variance * prior_information;
  const Eigen::MatrixXd sandwich =
      covariance * (evidence.scatter + trial.variance * trial.variance * prior_information) *
      covariance;
  const Eigen::VectorXd plain = trial.variance * covariance.diagonal();
  trial.sigma = plain.cwiseMax(sandwich.diagonal()).cwiseSqrt();
  const double expected = (covariance * of_residuals).trace();
  const double seen = (covariance * evidence.scatter).trace();
  const double least = trial.noise_px * trial.noise_px;
  trial.variance = expected > 0.0 ? std::max(seen / expected, least) : least;
}

/// One adjustment from the calibration reached; whether there is one.
bool adjust_once(const CalibrationParameters& parameters,
                 const std::vector<CameraMeasurements>& cameras,
                 const std::vector<std::uint8_t>& is_free,
                 BundleProblem& problem,
                 Trial& trial) {
  BundleCalibration calibration;
  calibration.rig = trial.rig.get();
  calibration.blocks = parameters.blocks();
  calibration.first_derivative.assign(problem.observations.size(), 0);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const RigCamera& camera = trial.rig->cameras[c];
    const auto directions = predict(cameras[c], camera.cam_from_rig, problem);
    linearize(cameras[c], *camera.camera, directions, problem);
    if (!add_derivatives(parameters, c, trial.change, cameras[c], directions, calibration)) {
      return false;
    }
  }
  const Eigen::MatrixXd prior = parameters.prior_information(trial.change, is_free);
  calibration.prior_information = trial.variance * prior;
  calibration.prior_change = -trial.change;
  calibration.change.setZero(trial.change.size());
  calibration.has_depths = true;
  problem.calibration = std::move(calibration);
  const BundleResult result =
      adjust_bundle(problem, {.num_rounds = 2, .max_iterations_per_round = 2});
  const BundleCalibration found = *std::exchange(problem.calibration, std::nullopt);
  Eigen::VectorXd change = trial.change + found.change;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters.list()[i].prior_sigma == 0.0) change[static_cast<Eigen::Index>(i)] = 0.0;
  }
  const std::optional<Rig> rig = parameters.rig_at(change);
  if (!rig || found.evidence.information.size() == 0) return false;
  auto next = std::make_shared<const Rig>(*rig);
  use_rig(*trial.rig, *next, problem);
  trial.rig = std::move(next);
  trial.change = std::move(change);
  trial.noise_px = result.noise_px;
  judge(found.evidence, prior, trial);
  return true;
}

/// Adjusts until the calibration moves no more, or until it is plain that no change comes near to
/// so many standard deviations; whether there is one.
bool adjust(const CalibrationParameters& parameters,
            const std::vector<CameraMeasurements>& cameras,
            const std::vector<std::uint8_t>& is_free,
            double min_sigmas,
            BundleProblem& problem,
            Trial& trial) {
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    const Eigen::VectorXd before = trial.change;
    if (!adjust_once(parameters, cameras, is_free, problem, trial)) return false;
    const Eigen::ArrayXd moved = (trial.change - before).array().abs() / trial.sigma.array();
    if (moved.maxCoeff() < kStill) break;
    // The first pass knows nothing of the noise yet.
    const Eigen::ArrayXd changed = trial.change.array().abs() / trial.sigma.array();
    if (pass > 0 && (changed + moved).maxCoeff() < kPlainly * min_sigmas) break;
  }
  return trial.variance < std::pow(kMaxDisagreement * trial.noise_px, 2);
}

/// What is looked at unless all is asked for. Centres and tangential distortion take up errors of
/// other kinds, such as those of a rolling shutter; a centre that is off can hardly be told from a
/// turn, and calibrations hardly err in it.
std::vector<std::uint8_t> likely_wrong(const std::vector<CalibrationParameter>& parameters) {
  std::vector<std::uint8_t> is_free;
  for (const CalibrationParameter& parameter : parameters) {
    is_free.push_back(parameter.group != CalibrationGroup::kCentre &&
                      parameter.group != CalibrationGroup::kTangential);
  }
  return is_free;
}

/// Of these the groups in which an estimate contradicts what was given. The distortion of other
/// cameras and where they stand is told by two images of one moment, and hard to tell apart: all or
/// none of that.
std::vector<std::uint8_t> contradicted(const std::vector<CalibrationParameter>& parameters,
                                       const Trial& trial,
                                       double min_sigmas,
                                       const std::vector<std::uint8_t>& is_free) {
  std::vector<CalibrationGroup> groups;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    if (is_free[i] && std::abs(trial.change[at]) > min_sigmas * trial.sigma[at]) {
      groups.push_back(parameters[i].group);
    }
  }
  std::vector<std::uint8_t> is_contradicted;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const CalibrationParameter& parameter = parameters[i];
    const bool is_of_pair =
        !parameter.name.starts_with("cam0.") && parameter.group != CalibrationGroup::kFocalLength;
    const bool is_in_group = std::ranges::find(groups, parameter.group) != groups.end();
    is_contradicted.push_back(is_free[i] && !groups.empty() && (is_of_pair || is_in_group));
  }
  return is_contradicted;
}

/// The largest change of a free parameter, in standard deviations.
double largest_change(const Trial& trial,
                      const KnownCalibration& known,
                      const std::vector<std::uint8_t>& is_free) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < trial.change.size(); ++i) {
    if (!is_free[static_cast<std::size_t>(i)]) continue;
    largest = std::max(largest, std::abs(trial.change[i] - known.change[i]) / trial.sigma[i]);
  }
  return largest;
}

/// A part of the points with all of their observations: what tells a calibration does so soon.
/// Those of camera 1 are pixels here, since ranges are made with the calibration.
struct CalibrationSample {
  BundleProblem problem;
  std::vector<Observation> observed;
};

CalibrationSample sample(const Map& map,
                         const Rig& rig,
                         const BundleProblem& problem,
                         std::span<const Observation> observed) {
  CalibrationSample sample{problem, {}};
  sample.problem.observations.clear();
  const auto add = [&](const BundleObservation& like, Observation seen) {
    const Features& features = *map.keyframes().at(seen.keyframe).features;
    Measurement measured = features.measurement(seen.feature);
    if (problem.rigs[like.pose] == &rig) {
      // As the depth image has it, along z, in which no calibration has a part.
      const float along_z = measured.bearing.z();
      measured.inverse_range /= along_z;
      measured.inverse_range_sigma =
          along_z > kLeastAlongZ ? measured.inverse_range_sigma / along_z : 0.0f;
    }
    sample.problem.observations.push_back({measured, like.pose, like.point});
    sample.observed.push_back(seen);
  };
  const std::size_t stride = 1 + observed.size() / kMaxObservations;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    const BundleObservation& observation = problem.observations[i];
    if (observation.point % stride != 0) continue;
    add(observation, observed[i]);
    const Features& features = *map.keyframes().at(observed[i].keyframe).features;
    const std::uint32_t partner = features.partner[observed[i].feature];
    if (partner == kNoFeature) continue;
    sample.problem.observations.back().inverse_range_sigma = 0.0f;
    add(observation, {observed[i].keyframe, partner});
  }
  return sample;
}

}  // namespace

KnownCalibration KnownCalibration::as_given(std::shared_ptr<const Rig> rig,
                                            bool is_always_refined) {
  KnownCalibration known{rig, rig, {}, {}, CalibrationParameters(*rig).list()};
  const auto count = static_cast<Eigen::Index>(known.parameters.size());
  known.change.setZero(count);
  known.sigma.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    known.sigma[i] = known.parameters[static_cast<std::size_t>(i)].prior_sigma;
  }
  known.is_always_refined = is_always_refined;
  known.given_readout_s = known.given->cameras[0].readout_s;
  known.given_depth_offset = known.given->inverse_depth_offset;
  return known;
}

std::vector<CalibrationEstimate> KnownCalibration::estimates() const {
  std::vector<CalibrationEstimate> estimates;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    estimates.push_back({parameters[i].name,
                         parameters[i].given,
                         change[at],
                         parameters[i].prior_sigma,
                         sigma[at]});
  }
  if (readout_sigma_s > 0.0) {
    const double readout_s = rig->cameras[0].readout_s;
    estimates.push_back({"readout_ms",
                         1e3 * given_readout_s,
                         1e3 * (readout_s - given_readout_s),
                         1e3 * kReadoutPriorS,
                         1e3 * readout_sigma_s});
  }
  if (depth_offset_sigma > 0.0) {
    estimates.push_back({"depth.inverse_offset",
                         given_depth_offset,
                         rig->inverse_depth_offset - given_depth_offset,
                         kDepthOffsetPrior,
                         depth_offset_sigma});
  }
  return estimates;
}

std::optional<KnownCalibration> recalibrate(const Map& map,
                                            std::span<const Observation> observed,
                                            const KnownCalibration& known,
                                            BundleProblem& problem) {
  const CalibrationParameters parameters(*known.given);
  if (parameters.size() == 0) return std::nullopt;
  CalibrationSample part = sample(map, *known.rig, problem, observed);
  const auto cameras = collect(map, part.observed, *known.rig, part.problem);
  const Trial start{known.rig, known.change, known.sigma};
  std::vector<std::uint8_t> is_free = known.is_always_refined
                                          ? std::vector<std::uint8_t>(parameters.size(), 1)
                                          : likely_wrong(known.parameters);
  const auto num_keyframes = static_cast<double>(part.problem.rig_from_world.size());
  const double inflation = std::max(1.0, kManyKeyframes / num_keyframes);
  Trial trial = start;
  BundleProblem adjusted = part.problem;
  const double min_sigmas = known.is_always_refined ? 0.0 : kMinSigmas * inflation;
  if (!adjust(parameters, cameras, is_free, min_sigmas, adjusted, trial)) return std::nullopt;
  // What the images do not tell stays as given, or it would take up errors of other kinds.
  if (!known.is_always_refined) {
    is_free = contradicted(known.parameters, trial, min_sigmas, is_free);
    if (std::ranges::count(is_free, 1) == 0) return std::nullopt;
    adjusted = part.problem;
    trial = start;
    if (!adjust(parameters, cameras, is_free, 0.0, adjusted, trial)) return std::nullopt;
  }
  if (largest_change(trial, known, is_free) < kMinChange) return std::nullopt;
  problem.rig_from_world = adjusted.rig_from_world;
  problem.points = adjusted.points;
  recompute(map, observed, *known.rig, trial.rig, problem);
  KnownCalibration found = known;
  found.rig = std::move(trial.rig);
  found.change = std::move(trial.change);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const bool is_estimated = is_free[i] && parameters.list()[i].prior_sigma > 0.0;
    const auto at = static_cast<Eigen::Index>(i);
    found.sigma[at] = is_estimated ? inflation * trial.sigma[at] : parameters.list()[i].prior_sigma;
  }
  return found;
}

}  // namespace waymark
