// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/system.h"

#include <utility>

#include "waymark/base/check.h"
#include "waymark/system/back_end.h"
#include "waymark/system/frame_preparation.h"
#include "waymark/system/inertial_estimator.h"
#include "waymark/system/starting_map.h"
#include "waymark/system/trajectory.h"
#include "waymark/track/tracker.h"

namespace waymark {
class System::Impl {
 public:
  Impl(Rig rig,
       const Settings& settings,
       Timing timing,
       std::shared_ptr<const Map> map,
       unsigned num_threads)
      : given_rig_(std::make_shared<const Rig>(
            with_depth_offset(std::move(rig), settings.depth.inverse_offset))),
        settings_(settings),
        timing_(timing),
        num_threads_(num_threads),
        preparation_(given_rig_, settings, timing == Timing::kLockstep ? num_threads : 0),
        memory_(frame_after(map.get())),
        is_frame_free_(!map && !markers_to_look_for(settings.markers)),
        back_end_(given_rig_, settings, timing) {
    if (!map) return;
    check_cameras(*map);
    visible_.snapshot = index_map(std::move(map));
    back_end_.take_over(visible_.snapshot);
  }

  const TrackingResult& feed(const FrameImages& images);
  void prepare(const FrameImages& images, std::shared_ptr<const void> owner) {
    preparation_.prepare(images, std::move(owner));
  }
  std::size_t max_prepared() const { return preparation_.max_prepared(); }
  void set_imu(const ImuCalibration& calibration) { inertial_.set_calibration(calibration); }
  void feed_imu(const ImuSample& sample) { inertial_.add(sample); }
  const InertialEstimator& inertial() const { return inertial_; }
  void finish();
  void keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory);
  void set_mapping(bool is_on);
  /// The same, from its beginning and with an empty map.
  std::unique_ptr<Impl> begin_anew() const;
  std::vector<TrajectoryFrame> trajectory() const { return list_poses(memory_, *map()); }
  std::vector<FrameState> frame_states() const { return list_states(memory_); }
  std::shared_ptr<const Map> map() const { return visible_.snapshot.map; }
  SystemStatistics statistics() const;
  std::shared_ptr<const Rig> rig() const {
    return visible_.calibration.rig ? visible_.calibration.rig : given_rig_;
  }
  std::vector<CalibrationEstimate> calibration() const;
  std::vector<TransferredScale> kept_scales() const {
    return tracker_ ? tracker_->kept_scales(*map()) : std::vector<TransferredScale>{};
  }
  const TrackingResult& result() const { return result_; }
  const Image& ego_mask() const { return preparation_.ego_mask(); }
  MarkerReport markers() const {
    return is_finished_ ? preparation_.markers().report(back_end_.marker_survey()) : MarkerReport{};
  }

 private:
  void make_tracker(bool has_range);
  RigMotion predict_motion(std::int64_t timestamp_ns) const;
  void hand_over(const Frame& frame, const FrameImages& images, MapperMessage message);
  std::vector<std::pair<KeyframeId, RigMotion>> motions() const;

  const std::shared_ptr<const Rig> given_rig_;
  const Settings settings_;
  const Timing timing_;
  const unsigned num_threads_;
  FramePreparation preparation_;
  std::optional<Tracker> tracker_;
  TrajectoryMemory memory_;
  const bool is_frame_free_;  ///< Neither a map made before nor markers tell where things are.
  InertialEstimator inertial_;
  PublishedMap visible_;
  TrackingResult result_;
  TrackingPurpose purpose_ = TrackingPurpose::kMapping;
  bool is_finished_ = false;
  BackEnd back_end_;  ///< Last, so that its threads end first.
};

const TrackingResult& System::Impl::feed(const FrameImages& images) {
  WAYMARK_CHECK(!is_finished_);
  const auto& past = memory_.entries();
  if (!past.empty() && images.timestamp_ns <= past.back().timestamp_ns) {
    throw InputError("frame " + std::to_string(past.size()),
                     "time stamp is not later than that of the frame before");
  }
  result_ = {};
  const FrameId id = memory_.next();
  result_.frame = FrameId{id.value - memory_.first().value};
  if (!tracker_) make_tracker(!images.image1.is_empty() || !images.depth.is_empty());
  preparation_.set_calibration(rig());
  Frame frame = preparation_.make_frame(
      id, images, [&] { return predict_motion(images.timestamp_ns); }, result_);
  if (const auto last_ns = tracker_->last_pose_ns()) {
    frame.turn = inertial_.turn(*last_ns, frame.timestamp_ns);
    frame.turn_rad_s = inertial_.turn_rad_s(frame.timestamp_ns);
    if (inertial_.has_samples()) {
      frame.dead_reckon = [&, time_ns = frame.timestamp_ns] {
        return inertial_.dead_reckon(memory_, *map(), time_ns);
      };
    }
  }
  if (inertial_.has_samples()) {
    frame.is_at_rest = inertial_.is_at_rest(frame.timestamp_ns);
    frame.contradicts_turn = [&, time_ns = frame.timestamp_ns](std::int64_t begin_ns,
                                                               const Eigen::Quaterniond& turn,
                                                               double largest_bias) {
      return inertial_.contradicts_turn(begin_ns, time_ns, turn, largest_bias);
    };
  }
  {
    StageTimer timer(result_.stages, Stage::kWait);
    back_end_.update(id, visible_);
  }
  if (visible_.placement) inertial_.note_placement(*visible_.placement, result_.frame);
  std::optional<MapperMessage> message = tracker_->track(frame, visible_.snapshot, result_);
  preparation_.watch(images.image0, result_);
  memory_.add(frame, result_, *map());
  const std::optional<SubmapPlacement> placement = inertial_.update(memory_, *map());
  if (message) hand_over(frame, images, *std::move(message));
  if (placement && is_frame_free_) back_end_.place(frame.id, *placement);
  return result_;
}

RigMotion System::Impl::predict_motion(std::int64_t timestamp_ns) const {
  RigMotion motion = tracker_->predict_motion();
  if (motion == RigMotion{}) return motion;
  if (const auto turn_rad_s = inertial_.turn_rad_s(timestamp_ns)) motion.turn_rad_s = *turn_rad_s;
  return motion;
}

void System::Impl::hand_over(const Frame& frame, const FrameImages& images, MapperMessage message) {
  if (frame.find_markers) {
    StageTimer timer(result_.stages, Stage::kKeyframe);
    preparation_.markers().add_markers(
        frame, images, *preparation_.rig(), *map(), result_, message);
  }
  const Stage stage = back_end_.waits_for(message) ? Stage::kWait : Stage::kKeyframe;
  StageTimer timer(result_.stages, stage);
  back_end_.send(frame.id, std::move(message));
}

void System::Impl::make_tracker(bool has_range) {
  if (has_range) check_has_scale(*map());
  tracker_.emplace(has_range, settings_.tracking, static_cast<std::uint64_t>(settings_.seed));
  if (!map()->submaps().empty()) tracker_->begin_in(*map(), purpose_);
  tracker_->set_purpose(purpose_);
}

void System::Impl::keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory) {
  WAYMARK_CHECK(!tracker_);  // The mapper's thread has nothing to do yet.
  back_end_.keep_map_in(std::move(memory));
}

void System::Impl::set_mapping(bool is_on) {
  purpose_ = is_on ? TrackingPurpose::kMapping : TrackingPurpose::kLocalizing;
  if (tracker_) tracker_->set_purpose(purpose_);
}

std::unique_ptr<System::Impl> System::Impl::begin_anew() const {
  WAYMARK_CHECK(!is_finished_);
  auto anew = std::make_unique<Impl>(*given_rig_, settings_, timing_, nullptr, num_threads_);
  anew->purpose_ = purpose_;
  anew->inertial_ = inertial_.begin_anew();
  anew->keep_map_in(back_end_.map_memory());
  return anew;
}

std::vector<CalibrationEstimate> System::Impl::calibration() const {
  const KnownCalibration& known = visible_.calibration;
  return known.is_changed() ? known.estimates() : std::vector<CalibrationEstimate>{};
}

void System::Impl::finish() {
  if (is_finished_) return;
  is_finished_ = true;
  back_end_.end_threads();
  visible_ = back_end_.finish(motions());
  const bool is_placed = back_end_.marker_survey().frame.has_value();
  const bool is_frame_free = is_frame_free_ && !is_placed;
  memory_.settle(*rig(), *map());
  if (const auto before = map(); is_frame_free) {
    visible_.snapshot.map = inertial_.adjust(memory_, before);
    if (map() != before) memory_.settle(*rig(), *map());
  }
  visible_.snapshot.map = inertial_.finish(memory_, map(), is_frame_free);
}

/// How the rig moved at the keyframes, where that matters.
std::vector<std::pair<KeyframeId, RigMotion>> System::Impl::motions() const {
  if (!settings_.calibration.is_refined() && given_rig_->cameras[0].readout_s == 0.0) return {};
  const Map& map = back_end_.map();
  auto motions = list_motions(memory_, map);
  for (auto& [id, motion] : motions) {
    const FrameId frame = map.keyframes().at(id).frame;
    const auto& entry = memory_.entries()[frame.value - memory_.first().value];
    if (const auto rate = inertial_.turn_rad_s(entry.timestamp_ns)) motion.turn_rad_s = *rate;
  }
  return motions;
}

SystemStatistics System::Impl::statistics() const {
  SystemStatistics statistics;
  statistics.num_keyframes = static_cast<int>(map()->keyframes().size());
  statistics.num_landmarks = static_cast<int>(map()->landmarks().size());
  for (const Submap& submap : map()->submaps()) {
    statistics.num_submaps += !submap.joined_into.is_valid();
  }
  statistics.num_loops = visible_.num_loops;
  statistics.num_relocalizations = memory_.num_relocalizations();
  statistics.mapping_ms = visible_.mapping_ms;
  return statistics;
}

System::System(Rig rig,
               const Settings& settings,
               Timing timing,
               std::shared_ptr<const Map> map,
               unsigned num_threads)
    : impl_(std::make_unique<Impl>(std::move(rig), settings, timing, std::move(map), num_threads)) {
}
System::~System() = default;
const TrackingResult& System::feed(const FrameImages& images) { return impl_->feed(images); }
void System::prepare(const FrameImages& images, std::shared_ptr<const void> owner) {
  impl_->prepare(images, std::move(owner));
}
void System::set_imu(const ImuCalibration& calibration) { impl_->set_imu(calibration); }
void System::feed_imu(const ImuSample& sample) { impl_->feed_imu(sample); }
const std::optional<InertialReport>& System::inertial() const { return impl_->inertial().report(); }
const std::vector<NavigationState>& System::inertial_path() const {
  return impl_->inertial().path();
}
std::vector<NavigationState> System::inertial_path_at_imu_rate() const {
  return impl_->inertial().path_at_imu_rate();
}
std::optional<double> System::imu_rate_hz() const { return impl_->inertial().rate_hz(); }
std::size_t System::max_prepared() const { return impl_->max_prepared(); }
void System::finish() { impl_->finish(); }
void System::keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory) {
  impl_->keep_map_in(std::move(memory));
}
void System::set_mapping(bool is_on) { impl_->set_mapping(is_on); }
void System::reset() { impl_ = impl_->begin_anew(); }
std::vector<TrajectoryFrame> System::trajectory() const { return impl_->trajectory(); }
std::vector<FrameState> System::frame_states() const { return impl_->frame_states(); }
std::vector<TransferredScale> System::kept_scales() const { return impl_->kept_scales(); }
MarkerReport System::markers() const { return impl_->markers(); }
Image System::ego_mask() const { return impl_->ego_mask(); }
std::shared_ptr<const Rig> System::rig() const { return impl_->rig(); }
std::vector<CalibrationEstimate> System::calibration() const { return impl_->calibration(); }
const TrackingResult& System::result() const { return impl_->result(); }
std::shared_ptr<const Map> System::map() const { return impl_->map(); }
SystemStatistics System::statistics() const { return impl_->statistics(); }

}  // namespace waymark
