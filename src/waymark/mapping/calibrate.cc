// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/calibrate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "waymark/mapping/calibration_choice.h"
#include "waymark/mapping/camera_measurements.h"
#include "waymark/solver/residual.h"

namespace waymark {
namespace {

/// An adjustment is linear in the intrinsics: it is repeated until they move no more.
constexpr int kMaxPasses = 10;
/// What was given is replaced by what makes parts of the way that it was not fitted to likelier by
/// so many nats, and their squared residuals smaller by this share: what gains less is as well
/// explained by errors of matching (docs/decisions/calibrate.md).
constexpr double kMinGain = 10.0;
constexpr double kMinShare = 0.01;
/// By so many nats where systematic errors of what images tell are taken for known: three standard
/// deviations.
constexpr double kMinSystematicGain = 4.5;
/// What was found before, by what is likelier by two standard deviations.
constexpr double kLeastGain = 2.0;
/// Parts of a way with fewer keyframes share most of what they see, err alike, and scatter by less
/// than they err, in the ratio of the numbers.
constexpr double kManyKeyframes = 30.0;
/// Where the parts of the way contradict each other by this much more than corners scatter, what is
/// wrong is not the calibration: a rolling shutter (5.5), a constant offset of inverse depths (5),
/// a stabilised video. Where it is, they do by up to 3.6.
constexpr double kMaxDisagreement = 4.0;
/// Before parts can be compared, errors that last are taken to make the variance of residuals
/// larger by this factor.
constexpr double kLastingErrors = 5.0;
/// A step that gains fewer nats is none.
constexpr double kStill = 0.5;
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
  /// Of a residual's component, in px^2, by what the parts of the way disagree: more than its
  /// noise, since errors that last count only once.
  double variance = 1.0;
  double noise = 1.0;  ///< The same without the parts, px^2.
};

/// The calibration reached as unknowns; nothing where there is no such camera. prior_information:
/// empty: they are measured, and do not move.
std::optional<BundleCalibration> unknowns(const CalibrationParameters& parameters,
                                          const std::vector<CameraMeasurements>& cameras,
                                          const Eigen::MatrixXd& prior_information,
                                          const Trial& trial,
                                          BundleProblem& problem) {
  BundleCalibration calibration;
  calibration.rig = trial.rig.get();
  calibration.blocks = parameters.blocks();
  calibration.first_derivative.assign(problem.observations.size(), 0);
  calibration.prior_change = -trial.change;
  calibration.change.setZero(trial.change.size());
  calibration.has_depths = true;
  calibration.prior_information = trial.variance * prior_information;
  if (prior_information.size() == 0) {
    // Any that keeps the equations solvable.
    std::vector<double> sigmas;
    for (const CalibrationParameter& one : parameters.list()) sigmas.push_back(one.usual_sigma);
    calibration.prior_information = parameters.prior_information(sigmas);
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const RigCamera& camera = trial.rig->cameras[c];
    const auto directions = predict(cameras[c], camera.cam_from_rig, problem);
    linearize(cameras[c], camera, directions, problem);
    if (!add_derivatives(parameters, c, trial.change, cameras[c], directions, calibration)) {
      return std::nullopt;
    }
  }
  return calibration;
}

/// Moves a trial by what an adjustment found; whether there is such a camera.
bool move(const CalibrationParameters& parameters,
          const Eigen::VectorXd& step,
          BundleProblem& problem,
          Trial& trial) {
  Eigen::VectorXd change = trial.change + step;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters.list()[i].prior_sigma == 0.0) change[static_cast<Eigen::Index>(i)] = 0.0;
  }
  const std::optional<Rig> rig = parameters.rig_at(change);
  if (!rig) return false;
  auto next = std::make_shared<const Rig>(*rig);
  use_rig(*trial.rig, *next, problem);
  trial.rig = std::move(next);
  trial.change = std::move(change);
  return true;
}

/// Adjusts from the calibration reached, with a prior; without one measures only. What the images
/// tell then, if anything.
std::optional<CalibrationCost> adjust(const CalibrationParameters& parameters,
                                      const std::vector<CameraMeasurements>& cameras,
                                      const Eigen::MatrixXd& prior_information,
                                      BundleProblem& problem,
                                      Trial& trial) {
  problem.calibration = unknowns(parameters, cameras, prior_information, trial, problem);
  if (!problem.calibration) return std::nullopt;
  const int num_steps = prior_information.size() == 0 ? 0 : 2;
  const BundleResult result = adjust_bundle(
      problem, {.num_rounds = num_steps == 0 ? 1 : 2, .max_iterations_per_round = num_steps});
  BundleCalibration found = *std::exchange(problem.calibration, std::nullopt);
  if (found.evidence.is_empty()) return std::nullopt;
  if (num_steps > 0 && !move(parameters, found.change, problem, trial)) return std::nullopt;
  trial.noise = result.noise_px * result.noise_px;
  return CalibrationCost{trial.change, std::move(found.evidence), trial.variance};
}

/// What images and the likeliest prior tell, where residuals have this variance. Parts of few
/// keyframes err alike.
CalibrationPosterior posterior_with(double variance,
                                    const CalibrationParameters& parameters,
                                    const KnownCalibration& known,
                                    std::size_t num_keyframes,
                                    CalibrationCost& cost) {
  const double few = std::max(1.0, kManyKeyframes / static_cast<double>(num_keyframes));
  cost.variance = few * few * variance;
  return choose_prior(parameters, cost, known.is_always_refined);
}

/// Whether what was found is to replace what is in use. What was given is asked more for than what
/// has replaced it already.
bool is_better(const CalibrationCost& cost,
               const CalibrationPosterior& found,
               const KnownCalibration& known,
               double squared_residuals) {
  if (known.is_always_refined || known.is_changed()) {
    return gain(cost, found, known.change) > kLeastGain;
  }
  const double predicted = predicted_gain(cost, found, known.change);
  return found.gain > kMinSystematicGain && predicted > kMinGain &&
         predicted * cost.variance > kMinShare * squared_residuals;
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

/// What was known, with what a trial found.
KnownCalibration with_found(const KnownCalibration& known,
                            const CalibrationPosterior& found,
                            Trial trial) {
  KnownCalibration next = known;
  next.rig = std::move(trial.rig);
  next.change = std::move(trial.change);
  for (std::size_t i = 0; i < known.parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    next.sigma[at] =
        found.prior_sigmas[i] > 0.0 ? found.sigma[at] : known.parameters[i].prior_sigma;
  }
  return next;
}

/// Adjusts a sample until the calibration moves no more; nothing as soon as it is plain that what
/// is in use stays. trial: in use, and what was found.
std::optional<CalibrationPosterior> adjust_until_still(
    const CalibrationParameters& parameters,
    const std::vector<CameraMeasurements>& cameras,
    const KnownCalibration& known,
    BundleProblem& problem,
    Trial& trial) {
  const std::size_t num_keyframes = problem.rig_from_world.size();
  const auto num_observations = static_cast<double>(problem.observations.size());
  auto cost = adjust(parameters, cameras, {}, problem, trial);
  if (!cost) return std::nullopt;
  CalibrationPosterior found =
      posterior_with(kLastingErrors * trial.noise, parameters, known, num_keyframes, *cost);
  if (gain(*cost, found, known.change) < kLeastGain) return std::nullopt;
  // What is wrong by much is found from the widest prior, and judged then.
  found.prior_information = widest_prior(parameters, known.is_always_refined);
  trial.variance = cost->variance;
  bool do_agree = false;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    cost = adjust(parameters, cameras, found.prior_information, problem, trial);
    if (!cost) return std::nullopt;
    found = posterior_with(trial.variance, parameters, known, num_keyframes, *cost);
    trial.variance = std::max(variance_between_parts(*cost, found), trial.noise);
    found = posterior_with(trial.variance, parameters, known, num_keyframes, *cost);
    if (!is_better(*cost, found, known, trial.noise * num_observations)) return std::nullopt;
    // Before it is found, parts contradict each other in what is wrong, too.
    do_agree = trial.variance < kMaxDisagreement * kMaxDisagreement * trial.noise;
    if (do_agree && gain(*cost, found, trial.change) < kStill) break;
  }
  if (!do_agree) return std::nullopt;
  return found;
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
  Trial trial{known.rig, known.change};
  const auto found = adjust_until_still(parameters, cameras, known, part.problem, trial);
  if (!found) return std::nullopt;
  problem.rig_from_world = part.problem.rig_from_world;
  problem.points = part.problem.points;
  recompute(map, observed, *known.rig, trial.rig, problem);
  return with_found(known, *found, std::move(trial));
}

}  // namespace waymark
