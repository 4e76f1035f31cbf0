// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/inertial_estimator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/imu/imu_health.h"
#include "waymark/imu/preintegration.h"
#include "waymark/map/align.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/system/inertial_join.h"
#include "waymark/system/inertial_poses.h"
#include "waymark/system/trajectory.h"

namespace waymark {
namespace {

/// Looks at the way begin with as many frames, and come again when it is half as long again.
constexpr std::size_t kFirstFrames = 20;
constexpr double kGrowth = 1.5;
/// Poses of vision are that good: in rad, and as a part of how far away things are.
constexpr double kPoseSigma = 0.001;
/// Errors of a pose in standard deviations that count fully.
constexpr double kPoseHuber = 2.0;
/// What was told is wrong where vision and IMU are off by so many standard deviations.
constexpr double kFarFromTold = 5.0;
/// Larger biases of an accelerometer, in m/s^2, are those of one that measures wrong lengths.
constexpr double kMaxAccelerometerBias = 0.8;
/// Poses of vision err alike for long, which no number of them averages out.
constexpr double kSystematicRotation = 5e-4;  // rad
constexpr double kSystematicTimeShift_s = 2e-4;
/// Of noise as is usual: none has less, whatever is told and a rest shows.
constexpr double kLeastNoise = 0.1;
/// So many samples show their noise.
constexpr std::size_t kShownSamples = 2000;
/// Of the lengths of a map that is metric, as a part: baselines and depths are that good.
constexpr double kMetricSigma = 0.01;
/// A turn of the gyroscope is told where that of its mounting, in rad, has a smaller standard
/// deviation.
constexpr double kFirmRotation = 0.02;
/// Of the scale with which the map is put into metres while it grows, once.
constexpr double kSureScale = 0.01;
/// Rates of turn that biases may have, rad/s.
constexpr double kFirmBias = 0.01;
/// Rest has lasted so long, with as many samples.
constexpr std::int64_t kRestNs = 400'000'000;
constexpr std::int64_t kMinRestNs = 90'000'000;  ///< At the start, where there are no more.
constexpr std::size_t kMinRestSamples = 10;
/// A turn that two poses tell is off by less, in rad and as a part of it.
constexpr double kTurnError = 0.003;
constexpr double kTurnPart = 0.04;

/// What puts a part of the map into metres, level.
Sim3 level_and_metric(const InertialSetup& setup) {
  return Sim3(turn_upright(-setup.gravity), Eigen::Vector3d::Zero(), std::exp(setup.log_scale));
}

/// Whether an estimate is further from what was believed before than both allow: what it moved by
/// has the variance that what was measured took away.
bool is_far(double moved, double sigma_before, double sigma) {
  const double taken = sigma_before * sigma_before - sigma * sigma;
  const double least = 0.01 * sigma_before * sigma_before;
  return moved * moved > kFarFromTold * kFarFromTold * std::max(taken, least);
}

bool is_far_from_told(const InertialStart& start,
                      const ImuCalibration& told,
                      const InertialStartOptions& options) {
  if (told.time_shift_s && is_far(start.time_shift_s - *told.time_shift_s,
                                  options.told_time_shift_sigma_s,
                                  start.sigma(kTimeShiftAt))) {
    return true;
  }
  if (!told.imu_from_rig) return false;
  const Rigid3& found = start.setup.imu_from_rig;
  const Eigen::Vector3d lever_arm =
      found.origin_in_source() - told.imu_from_rig->origin_in_source();
  return is_far(found.rotation.angularDistance(told.imu_from_rig->rotation),
                options.told_rotation_sigma,
                largest_sigma(start.covariance(), kRotationAt)) ||
         is_far(lever_arm.norm(),
                options.told_lever_arm_sigma,
                largest_sigma(start.covariance(), kLeverArmAt));
}

/// As told, but not less than the samples themselves show, and than biases usually walk.
ImuNoise noise_of(const ImuCalibration& told, std::span<const ImuSample> samples) {
  const ImuNoise usual = default_imu_noise();
  const ImuNoise noise = told.noise.value_or(usual);
  const ImuNoise shown = shown_imu_noise(samples.last(std::min(samples.size(), kShownSamples)));
  return {std::max({noise.gyroscope, shown.gyroscope, kLeastNoise * usual.gyroscope}),
          std::max({noise.accelerometer, shown.accelerometer, kLeastNoise * usual.accelerometer}),
          std::max(noise.gyroscope_walk, usual.gyroscope_walk),
          std::max(noise.accelerometer_walk, usual.accelerometer_walk)};
}

void describe(const InertialStart& start, InertialReport& report) {
  const double less_sure = start.less_sure();
  report.is_used = true;
  report.scale_sigma = std::hypot(less_sure * start.sigma(kLogScaleAt), kSystematicScale);
  report.gravity_in_world = start.setup.gravity;
  report.gravity_sigma_rad =
      std::hypot(less_sure * largest_sigma(start.covariance(), kGravityAt, 2), kSystematicRotation);
  report.time_shift_s = start.time_shift_s;
  report.time_shift_sigma_s =
      std::hypot(less_sure * start.sigma(kTimeShiftAt), kSystematicTimeShift_s);
  report.imu_from_rig = start.setup.imu_from_rig;
  report.rotation_sigma_rad =
      std::hypot(less_sure * largest_sigma(start.covariance(), kRotationAt), kSystematicRotation);
  report.lever_arm_sigma_m = less_sure * largest_sigma(start.covariance(), kLeverArmAt);
  report.biases = start.states.back().biases;
}

}  // namespace

void InertialEstimator::set_calibration(const ImuCalibration& told) {
  if (told.imu_from_rig) told_.imu_from_rig = told.imu_from_rig;
  if (told.time_shift_s) told_.time_shift_s = told.time_shift_s;
  if (told.noise) told_.noise = told.noise;
}

InertialEstimator InertialEstimator::begin_anew() const {
  InertialEstimator anew;
  anew.told_ = told_;
  return anew;
}

std::optional<double> InertialEstimator::rate_hz() const {
  if (samples_.period_ns() == 0) return std::nullopt;
  return 1e9 / static_cast<double>(samples_.period_ns());
}

std::optional<SubmapPlacement> InertialEstimator::update(const TrajectoryMemory& memory,
                                                         const Map& map) {
  const std::size_t num_frames = memory.entries().size();
  if (!has_samples() || num_frames < std::max(next_look_, kFirstFrames)) return std::nullopt;
  next_look_ = static_cast<std::size_t>(kGrowth * static_cast<double>(num_frames));
  const std::vector<TrajectoryFrame> frames = list_poses(memory, map);
  if (frames.empty()) return std::nullopt;
  const SubmapId submap = frames.back().submap;
  look(choose_poses(frames, submap), submap, map);
  if (!report_->is_used || report_->scale_sigma > kSureScale) return std::nullopt;
  if (is_placement_sent_ || map.submaps()[submap.value].is_metric) return std::nullopt;
  is_placement_sent_ = true;
  return SubmapPlacement{submap, level_and_metric(found_->setup)};
}

/// Of a part, which may be another one than that of the whole way.
InertialKnowledge InertialEstimator::knowledge_of(SubmapId submap, const Map& map) const {
  InertialKnowledge known = knowledge();
  if (submap == found_in_) return known;
  known.has_same_scale = false;
  known.distance_of_things = distance_of_things(map, submap);
  known.options.pose_position_sigma = kPoseSigma * known.distance_of_things;
  known.options.log_scale = 0.0;
  known.options.log_scale_sigma =
      map.submaps()[submap.value].is_metric ? kMetricSigma : InertialStartOptions().log_scale_sigma;
  return known;
}

void InertialEstimator::note_placement(const SubmapPlacement& placement, FrameId frame) {
  if (metric_from_) return;
  metric_from_ = frame;
  metric_submap_ = placement.submap;
  reckoning_.reset();
  const auto& [rotation, translation, scale] = placement.new_from_old;
  if (report_) report_->metric_from = frame;
  if (report_) report_->metric_submap = placement.submap;
  if (report_) report_->gravity_in_world = rotation * report_->gravity_in_world;
  if (!found_ || found_in_ != placement.submap) return;
  found_->setup.gravity = rotation * found_->setup.gravity;
  found_->setup.log_scale -= std::log(scale);
  options_.pose_position_sigma *= scale;
}

void InertialEstimator::look(std::span<const VisionPose> poses, SubmapId submap, const Map& map) {
  InertialStartOptions& options = options_ = {};
  found_in_ = submap;
  options.pose_huber = kPoseHuber;
  options.pose_rotation_sigma = kPoseSigma;
  options.pose_position_sigma = kPoseSigma * distance_of_things(map, submap);
  if (map.submaps()[submap.value].is_metric) options.log_scale_sigma = kMetricSigma;
  noise_ = noise_of(told_, samples_.all());
  found_ = start_inertial(samples_, poses, told_, noise_, options);
  if (!found_ || found_->is_contradicted() || is_far_from_told(*found_, told_, options)) {
    const ImuCalibration nothing;
    auto anew = start_inertial(samples_, poses, nothing, noise_, options);
    if (anew && !anew->is_contradicted()) found_ = std::move(anew);
  }
  report_.emplace();
  report_->metric_from = metric_from_;
  report_->metric_submap = metric_submap_;
  report_->submap = submap;
  if (!found_) {
    report_->reason = "too little was seen and measured at the same time";
  } else if (found_->is_contradicted()) {
    report_->reason = "it contradicts the images";
    found_.reset();
  } else if (found_->states.back().biases.accelerometer.norm() > kMaxAccelerometerBias) {
    report_->reason = "its accelerometer is off by more than one has";
    found_.reset();
  } else {
    describe(*found_, *report_);
  }
}

InertialKnowledge InertialEstimator::knowledge() const {
  return {samples_, *found_, noise_, options_, options_.pose_position_sigma / kPoseSigma};
}

bool InertialEstimator::is_firm() const {
  return found_ && largest_sigma(found_->covariance(), kRotationAt) < kFirmRotation &&
         largest_sigma(found_->covariance(), kGyroscopeBiasAt) < kFirmBias;
}

std::optional<ReckonedPose> InertialEstimator::dead_reckon(const TrajectoryMemory& memory,
                                                           const Map& map,
                                                           std::int64_t timestamp_ns) {
  if (!is_firm() || found_->sigma(kLogScaleAt) > kFirmScale) return std::nullopt;
  const auto& entries = memory.entries();
  const auto newest = std::find_if(
      entries.rbegin(), entries.rend(), [](const auto& entry) { return entry.is_seen(); });
  if (newest == entries.rend()) return std::nullopt;
  if (!reckoning_ || reckoning_->begin_ns() != newest->timestamp_ns) {
    std::vector<TrajectoryFrame> frames = list_poses(memory, map);
    std::erase_if(frames, [&](const TrajectoryFrame& frame) {
      return frame.state != FrameState::kTracked || frame.submap != found_in_;
    });
    if (frames.empty() || frames.back().timestamp_ns != newest->timestamp_ns) return std::nullopt;
    reckoning_.emplace(knowledge(), frames);
  }
  return reckoning_->to(knowledge(), timestamp_ns);
}

std::optional<Eigen::Quaterniond> InertialEstimator::turn_by(const Eigen::Quaterniond& imu_from_rig,
                                                             double time_shift_s,
                                                             const ImuBiases& biases,
                                                             std::int64_t begin_ns,
                                                             std::int64_t end_ns) const {
  if (end_ns - begin_ns > kMaxBridgedNs) return std::nullopt;
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * time_shift_s));
  std::vector<ImuSample> samples = samples_.between(begin_ns + shift_ns, end_ns + shift_ns);
  if (samples.empty()) return std::nullopt;
  const Preintegration turned(std::move(samples), default_imu_noise(), biases);
  return imu_from_rig.conjugate() * turned.delta().rotation.conjugate() * imu_from_rig;
}

std::optional<Eigen::Quaterniond> InertialEstimator::turn(std::int64_t begin_ns,
                                                          std::int64_t end_ns) const {
  if (!is_firm()) return std::nullopt;
  return turn_by(found_->setup.imu_from_rig.rotation,
                 found_->time_shift_s,
                 found_->states.back().biases,
                 begin_ns,
                 end_ns);
}

bool InertialEstimator::contradicts_turn(std::int64_t begin_ns,
                                         std::int64_t end_ns,
                                         const Eigen::Quaterniond& rig_end_from_rig_begin,
                                         double largest_bias) const {
  std::optional<Eigen::Quaterniond> measured = turn(begin_ns, end_ns);
  if (measured) {
    largest_bias = kFirmBias;
  } else if (told_.imu_from_rig) {
    const double time_shift_s = told_.time_shift_s.value_or(0.0);
    measured = turn_by(told_.imu_from_rig->rotation, time_shift_s, {}, begin_ns, end_ns);
  }
  if (!measured) return false;
  const double of_angle = kTurnPart * measured->angularDistance(Eigen::Quaterniond::Identity());
  const double of_bias = 1e-9 * static_cast<double>(end_ns - begin_ns) * largest_bias;
  return measured->angularDistance(rig_end_from_rig_begin) > kTurnError + of_angle + of_bias;
}

bool InertialEstimator::is_at_rest(std::int64_t timestamp_ns) const {
  if (report_ && !report_->is_used) return false;
  const double shift_s = found_ ? found_->time_shift_s : told_.time_shift_s.value_or(0.0);
  const std::int64_t end_ns = timestamp_ns + std::llround(1e9 * shift_s);
  const std::int64_t first_ns = samples_.all().front().timestamp_ns;
  const std::int64_t begin_ns = std::max(end_ns - kRestNs, first_ns);
  if (end_ns - begin_ns < kMinRestNs) return false;
  const std::vector<ImuSample> samples = samples_.between(begin_ns, end_ns);
  return samples.size() >= kMinRestSamples && shows_no_motion(samples);
}

std::optional<Eigen::Vector3f> InertialEstimator::turn_rad_s(std::int64_t timestamp_ns) const {
  constexpr std::int64_t kHalfNs = 10'000'000;  // About half of what rolling shutters take.
  const auto turned = turn(timestamp_ns - kHalfNs, timestamp_ns + kHalfNs);
  if (!turned) return std::nullopt;
  return (so3_log(*turned) / (2e-9 * static_cast<double>(kHalfNs))).cast<float>();
}

SubmapId InertialEstimator::look_at_largest(const TrajectoryMemory& memory, const Map& map) {
  const SubmapId largest = submaps_by_size(map).front();
  look(choose_poses(list_poses(memory, map), largest), largest, map);
  return largest;
}

std::shared_ptr<const Map> InertialEstimator::adjust(const TrajectoryMemory& memory,
                                                     std::shared_ptr<const Map> map) {
  if (!has_samples() || map->keyframes().is_empty()) return map;
  SubmapId submap = look_at_largest(memory, *map);
  const auto known = [&](SubmapId part) { return knowledge_of(part, *map); };
  while (is_firm() && join_parts(memory, known, map)) submap = look_at_largest(memory, *map);
  if (!is_firm() || found_->sigma(kLogScaleAt) > kFirmScale) return map;
  InertialStart found = *found_;
  if (map->submaps()[submap.value].is_metric) found.setup.log_scale = 0.0;
  // Noise is often stated larger than it is, for what else an IMU does wrong.
  const ImuNoise noise = noise_of({}, samples_.all());
  const GlobalAdjustment adjustment = adjust_with_imu(*map, submap, {samples_, noise, found});
  if (adjustment.correction.keyframes.empty()) return map;
  Map next = Map::thaw(*map);
  DirtyLandmarks dirty;
  apply_adjustment(next, adjustment, dirty);
  return next.freeze();
}

std::shared_ptr<const Map> InertialEstimator::finish(TrajectoryMemory& memory,
                                                     std::shared_ptr<const Map> map,
                                                     bool is_frame_free) {
  if (!has_samples() || map->keyframes().is_empty()) return map;
  const SubmapId submap = look_at_largest(memory, *map);
  if (report_->is_used && found_->sigma(kLogScaleAt) < kFirmScale) {
    path_ = smooth_trajectory(knowledge(), submap, *map, memory);
  }
  const bool is_metric = map->submaps()[submap.value].is_metric;
  const bool is_scaled =
      !is_metric && is_frame_free && report_->is_used && report_->scale_sigma < kFirmScale;
  if (!is_metric && !is_scaled) path_.clear();
  if (!report_->is_used || !is_frame_free) return map;
  Sim3 level = level_and_metric(found_->setup);
  if (!is_scaled) level.scale = 1.0;
  report_->gravity_in_world = level.rotation * report_->gravity_in_world;
  move_path(level);
  if (is_scaled && !report_->metric_from) {
    report_->metric_from = FrameId{static_cast<std::uint32_t>(memory.entries().size() - 1)};
  }
  if (!is_scaled) report_->metric_from.reset();
  Map next = Map::thaw(*map);
  if (is_scaled) {
    next = put_into_metres(std::move(next), submap, level);
  } else {
    transform_submap(next, submap, level);
  }
  place_other_parts(memory, *map, next);
  return next.freeze();
}

/// Puts the parts into metres, level, that are not the one that was looked at.
void InertialEstimator::place_other_parts(const TrajectoryMemory& memory,
                                          const Map& map,
                                          Map& placed) const {
  const std::vector<TrajectoryFrame> frames = list_poses(memory, map);
  for (const SubmapId part : submaps_by_size(map)) {
    const std::vector<VisionPose> poses = choose_poses(frames, part);
    if (part == found_in_ || map.submaps()[part.value].is_metric || poses.empty()) continue;
    const auto told = start_again(knowledge_of(part, map), poses);
    if (!told || told->is_contradicted() || told->sigma(kLogScaleAt) > kFirmScale) continue;
    placed = put_into_metres(std::move(placed), part, level_and_metric(told->setup));
  }
}

std::vector<NavigationState> InertialEstimator::path_at_imu_rate() const {
  return path_.empty() ? path_ : at_imu_rate(path_, samples_, *report_);
}

void InertialEstimator::move_path(const Sim3& new_from_old) {
  for (NavigationState& state : path_) {
    const Rigid3& old = state.world_from_rig;
    state.world_from_rig = {new_from_old.rotation * old.rotation, new_from_old * old.translation};
    state.velocity = new_from_old.rotation * state.velocity;
    state.covariance.topRows<3>() *= new_from_old.scale;
    state.covariance.leftCols<3>() *= new_from_old.scale;
  }
}

}  // namespace waymark
