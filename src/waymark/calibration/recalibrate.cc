// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibration/recalibrate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "waymark/calibration/camera_measurements.h"
#include "waymark/solver/residual.h"

namespace waymark {
namespace {

/// An adjustment is linear in the intrinsics: it is repeated until they move no more.
constexpr int kMaxPasses = 10;
/// What was given is replaced by what makes parts of the way that it was not fitted to likelier by
/// so many nats, and their squared residuals smaller by this share: what gains less is as well
/// explained by errors of matching, which differ smoothly over the image where pairs see slanted
/// surfaces (docs/decisions/calibrate.md).
constexpr double kMinGain = 10.0;
constexpr double kMinShare = 0.015;
constexpr double kMinShareOfPairs = 0.03;
/// What was found before is replaced by what predicts so much better; below it there is nothing to
/// look for: two standard deviations.
constexpr double kLeastGain = 2.0;
/// Parts of a way with fewer keyframes share most of what they see, err alike, and scatter by less
/// than they err, in the ratio of the numbers.
constexpr double kManyKeyframes = 30.0;
/// Before parts can be compared, errors that last are taken to make the variance of residuals
/// larger by this factor.
constexpr double kLastingErrors = 5.0;
/// The size of what is seen and what makes it so move slowly together: a step that is damped as
/// elsewhere takes a part of the way only.
constexpr double kInitialDamping = 1e-6;
/// A step that gains fewer nats is none.
constexpr double kStill = 0.5;
/// More tell hardly more, and take longer.
constexpr std::size_t kMaxObservations = 12000;
/// Ranges that are off by a larger share are of something else.
constexpr double kMaxOffRange = 0.5;

/// A part of the points with all of their observations: what tells a calibration does so soon.
/// Those of camera 1 are pixels here, since ranges are made with the calibration.
struct CalibrationSample {
  BundleProblem problem;
  std::vector<Observation> observed;
  std::vector<float> inverse_depths;  ///< As measured, 1/m; of what has a range.
};

/// Numbers of a rig that are being adjusted.
struct Trial {
  const CalibrationParameters& parameters;
  FreeParameters free;
  std::shared_ptr<const Rig> rig;
  Eigen::VectorXd change;
  /// Of a residual's component, in px^2, by what the parts of the way disagree: more than its
  /// noise, since errors that last count only once.
  double variance = 1.0;
  double noise = 1.0;  ///< The same without the parts, px^2.
};

/// Appends the derivatives of the pixels of a camera's observations by its intrinsics.
bool add_derivatives(const Trial& trial,
                     std::size_t camera,
                     const CameraMeasurements& measured,
                     const std::vector<Eigen::Vector3d>& directions,
                     const BundleProblem& problem,
                     BundleCalibration& calibration) {
  const auto derivatives = trial.parameters.pixel_by_intrinsics(camera, trial.change, directions);
  if (!derivatives) return false;
  const std::size_t count = calibration.blocks[camera].num_intrinsics;
  if (count == 0) return true;
  const bool has_depth_offset = trial.parameters.find(CalibrationGroup::kDepthOffset).has_value();
  const std::size_t of_readout = count - (has_depth_offset ? 2 : 1);
  std::vector<float>& all = calibration.level_pixel_by_intrinsics;
  for (std::size_t k = 0; k < measured.indices.size(); ++k) {
    const BundleObservation& observation = problem.observations[measured.indices[k]];
    calibration.first_derivative[measured.indices[k]] = all.size();
    for (std::size_t j = 0; j < count; ++j) {
      const double* const by = derivatives->data() + 2 * (k * count + j);
      Eigen::Vector2f counted =
          (measured.projectors[k] * Eigen::Vector2d(by[0], by[1])).cast<float>() /
          measured.level_scales[k];
      if (j == of_readout) {
        counted = observation.level_pixel_from_bearing * measured.bearing_by_readout_ms[k];
      }
      all.insert(all.end(), counted.begin(), counted.end());
    }
  }
  return true;
}

/// Measures depths with the offset reached, and appends their derivatives.
void use_depth_offset(const Trial& trial,
                      const Rig& before,
                      CalibrationSample& sample,
                      BundleCalibration& calibration) {
  if (!trial.parameters.find(CalibrationGroup::kDepthOffset)) return;
  const auto change =
      static_cast<float>(trial.rig->inverse_depth_offset - before.inverse_depth_offset);
  const std::size_t count = calibration.blocks[0].num_intrinsics;
  std::vector<float>& all = calibration.inverse_range_by_intrinsics;
  all.assign(count * sample.problem.observations.size(), 0.0f);
  for (std::size_t i = 0; i < sample.problem.observations.size(); ++i) {
    BundleObservation& observation = sample.problem.observations[i];
    if (!(observation.inverse_range_sigma > 0.0f)) continue;
    if (sample.problem.rigs[observation.pose] != trial.rig.get()) continue;
    observation.inverse_range = sample.inverse_depths[i] - change;
    all[count * (i + 1) - 1] = 1.0f;
  }
}

/// The cameras and depths of a sample, as they were measured before.
struct Measured {
  const Rig& before;
  std::vector<CameraMeasurements> cameras;
};

/// The calibration reached as unknowns; nothing where there is no such camera. prior: none: they
/// are measured, and do not move.
std::optional<BundleCalibration> unknowns(const Measured& measured,
                                          const CalibrationPrior* prior,
                                          const Trial& trial,
                                          CalibrationSample& sample) {
  BundleCalibration calibration;
  calibration.rig = trial.rig.get();
  calibration.blocks = trial.parameters.blocks();
  calibration.first_derivative.assign(sample.problem.observations.size(), 0);
  calibration.prior_change = -trial.change;
  calibration.change.setZero(trial.change.size());
  calibration.has_depths = true;
  if (prior) {
    calibration.prior_information = trial.variance * prior->information;
  } else {  // Any that keeps the equations solvable.
    std::vector<double> sigmas;
    for (const auto& one : trial.parameters.list()) sigmas.push_back(one.usual_sigma);
    calibration.prior_information = trial.parameters.prior_information(sigmas);
  }
  for (std::size_t c = 0; c < measured.cameras.size(); ++c) {
    const CameraMeasurements& of_camera = measured.cameras[c];
    const RigCamera& camera = trial.rig->cameras[c];
    const auto directions = predict(of_camera, camera.cam_from_rig, sample.problem);
    linearize(of_camera, camera, directions, sample.problem);
    if (!add_derivatives(trial, c, of_camera, directions, sample.problem, calibration)) {
      return std::nullopt;
    }
  }
  use_depth_offset(trial, measured.before, sample, calibration);
  return calibration;
}

/// Moves a trial by what an adjustment found, but for what is held; whether there is such a camera.
bool move(const Eigen::VectorXd& step,
          const CalibrationPrior& prior,
          BundleProblem& problem,
          Trial& trial) {
  Eigen::VectorXd change = trial.change + step;
  for (std::size_t i = 0; i < prior.sigmas.size(); ++i) {
    if (prior.sigmas[i] == 0.0) change[static_cast<Eigen::Index>(i)] = 0.0;
  }
  const std::optional<Rig> rig = trial.parameters.rig_at(change);
  if (!rig) return false;
  auto next = std::make_shared<const Rig>(*rig);
  use_rig(*trial.rig, *next, problem);
  trial.rig = std::move(next);
  trial.change = std::move(change);
  return true;
}

/// Adjusts from the calibration reached, with a prior; without one measures only. What the images
/// tell then, if anything.
std::optional<CalibrationCost> adjust(const Measured& measured,
                                      const CalibrationPrior* prior,
                                      CalibrationSample& sample,
                                      Trial& trial) {
  BundleProblem& problem = sample.problem;
  problem.calibration = unknowns(measured, prior, trial, sample);
  if (!problem.calibration) return std::nullopt;
  const int num_steps = prior ? 4 : 0;
  const BundleResult result = adjust_bundle(problem,
                                            {.num_rounds = prior ? 2 : 1,
                                             .max_iterations_per_round = num_steps,
                                             .initial_damping = kInitialDamping});
  BundleCalibration found = *std::exchange(problem.calibration, std::nullopt);
  if (found.evidence.is_empty()) return std::nullopt;
  if (prior && !move(found.change, *prior, problem, trial)) return std::nullopt;
  trial.noise = result.noise_px * result.noise_px;
  return CalibrationCost{trial.change, std::move(found.evidence), trial.variance};
}

/// What images and the likeliest prior tell, where residuals have this variance. Parts of few
/// keyframes err alike.
CalibrationPosterior posterior_with(double variance,
                                    const Trial& trial,
                                    std::size_t num_keyframes,
                                    CalibrationCost& cost) {
  const double few = std::max(1.0, kManyKeyframes / static_cast<double>(num_keyframes));
  cost.variance = few * few * variance;
  return choose_prior(trial.parameters, cost, trial.free);
}

/// Whether what was found is to replace what is in use. What was given is asked more for than what
/// has replaced it already.
bool is_better(const CalibrationCost& cost,
               const CalibrationPosterior& found,
               const KnownCalibration& known,
               double squared_residuals) {
  const double predicted = predicted_gain(cost, found, known.change);
  if (known.is_always_refined || known.is_changed()) return predicted > kLeastGain;
  const double min_share = known.given->cameras.size() > 1 ? kMinShareOfPairs : kMinShare;
  return predicted > kMinGain && predicted * cost.variance > min_share * squared_residuals;
}

/// What a depth image measured of a point: along z, in which no calibration has a part. Where a
/// surface ends, its nearest part is measured.
void measure_depth(const Features& features,
                   std::uint32_t feature,
                   double predicted_range,
                   Measurement& measured) {
  const float along_z = measured.bearing.z();
  const double off = measured.inverse_range * predicted_range - 1.0;
  const bool is_of_point =
      !features.is_edge(feature) && along_z > kLeastAlongZ && std::abs(off) < kMaxOffRange;
  measured.inverse_range /= along_z;
  measured.inverse_range_sigma = is_of_point ? measured.inverse_range_sigma / along_z : 0.0f;
}

CalibrationSample take_sample(const Map& map,
                              const Rig& rig,
                              const BundleProblem& problem,
                              std::span<const Observation> observed) {
  CalibrationSample sample{problem, {}, {}};
  sample.problem.observations.clear();
  const auto add = [&](const BundleObservation& like, Observation seen) {
    const Features& features = *map.keyframes().at(seen.keyframe).features;
    Measurement measured = features.measurement(seen.feature);
    if (problem.rigs[like.pose] == &rig) {
      const Eigen::Vector3d in_rig = problem.rig_from_world[like.pose] * problem.points[like.point];
      measure_depth(features, seen.feature, in_rig.norm(), measured);
    }
    sample.problem.observations.push_back({measured, like.pose, like.point});
    sample.observed.push_back(seen);
    sample.inverse_depths.push_back(measured.inverse_range);
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
        found.prior.sigmas[i] > 0.0 ? found.sigma[at] : known.parameters[i].prior_sigma;
  }
  return next;
}

/// Adjusts a sample until the calibration moves no more; nothing as soon as it is plain that what
/// is in use stays. trial: in use, and what was found.
std::optional<CalibrationPosterior> adjust_until_still(const Measured& measured,
                                                       const KnownCalibration& known,
                                                       CalibrationSample& sample,
                                                       Trial& trial) {
  const std::size_t num_keyframes = sample.problem.rig_from_world.size();
  const auto num_observations = static_cast<double>(sample.observed.size());
  auto cost = adjust(measured, nullptr, sample, trial);
  if (!cost) return std::nullopt;
  CalibrationPosterior found =
      posterior_with(kLastingErrors * trial.noise, trial, num_keyframes, *cost);
  const bool is_asked_for = known.is_always_refined && !known.is_told();
  if (!is_asked_for && gain(*cost, found, known.change) < kLeastGain) return std::nullopt;
  // What is wrong by much is found from the widest prior, and judged then.
  found.prior = widest_prior(trial.parameters, trial.free);
  trial.variance = cost->variance;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    cost = adjust(measured, &found.prior, sample, trial);
    if (!cost) return std::nullopt;
    found = posterior_with(trial.variance, trial, num_keyframes, *cost);
    trial.variance = std::max(variance_between_parts(*cost, found), trial.noise);
    found = posterior_with(trial.variance, trial, num_keyframes, *cost);
    const double squared_residuals = trial.noise * num_observations;
    if (!is_asked_for && !is_better(*cost, found, known, squared_residuals)) return std::nullopt;
    if (gain(*cost, found, trial.change) < kStill) break;
  }
  return found;
}

}  // namespace

std::optional<KnownCalibration> recalibrate(const Map& map,
                                            std::span<const Observation> observed,
                                            const KnownCalibration& known,
                                            FreeParameters free,
                                            BundleProblem& problem) {
  const CalibrationParameters parameters(*known.given);
  if (parameters.size() == 0) return std::nullopt;
  CalibrationSample sample = take_sample(map, *known.rig, problem, observed);
  const Measured measured{*known.rig, collect(map, sample.observed, *known.rig, sample.problem)};
  Trial trial{parameters, free, known.rig, known.change};
  const auto found = adjust_until_still(measured, known, sample, trial);
  if (!found) return std::nullopt;
  problem.rig_from_world = sample.problem.rig_from_world;
  problem.points = sample.problem.points;
  recompute(map, observed, *known.rig, trial.rig, problem);
  return with_found(known, *found, std::move(trial));
}

}  // namespace waymark
