// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/system.h"

#include <chrono>

#include "waymark/base/check.h"
#include "waymark/image/frame_builder.h"
#include "waymark/loop/global_mapper.h"
#include "waymark/marker/known_markers.h"
#include "waymark/system/frames_ahead.h"
#include "waymark/system/marker_finder.h"
#include "waymark/system/starting_map.h"
#include "waymark/system/trajectory.h"
#include "waymark/system/workers.h"
#include "waymark/track/tracker.h"

namespace waymark {
namespace {

FrameSettings frame_settings(const Settings& settings) {
  return {settings.features, settings.stereo, settings.depth, settings.view};
}

}  // namespace

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
        rig_(given_rig_),
        builder_(*rig_, frame_settings(settings)),
        ahead_(builder_, frame_settings(settings), timing == Timing::kLockstep ? num_threads : 0),
        memory_(rig_, frame_after(map.get())),
        mapper_(rig_,
                settings.mapping,
                settings.loop,
                settings.calibration,
                static_cast<std::uint64_t>(settings.seed),
                markers_to_look_for(settings.markers)),
        marker_finder_(settings.markers),
        adjuster_(timing),
        worker_(timing, [this](const MapTask& task) { return process(task); }) {
    if (!map) return;
    check_cameras(*map);
    visible_.snapshot = index_map(std::move(map));
    mapper_.take_over(visible_.snapshot);
  }

  TrackingResult feed(const FrameImages& images);
  void prepare(const FrameImages& images, std::shared_ptr<const void> owner) {
    ahead_.prepare(images, std::move(owner));
  }
  std::size_t max_prepared() const { return ahead_.capacity(); }
  void finish();
  void drop_seen_through();
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
  std::vector<KeptScale> kept_scales() const {
    return tracker_ ? tracker_->kept_scales(*map()) : std::vector<KeptScale>{};
  }
  const FocalCheck* focal_check() const;
  const FrameDetails& details() const { return details_; }
  const Image& ego_mask() const { return builder_.ego_mask(); }
  MarkerReport markers() const {
    return is_finished_ ? marker_finder_.report(mapper_.marker_survey()) : MarkerReport{};
  }

 private:
  void make_tracker(bool has_range);
  std::shared_ptr<const Features> build(const FrameImages& images, StageTimes& times);
  /// Looks for what moves along in a frame that was tracked.
  void watch(ImageView image0, const TrackOutcome& outcome, StageTimes& times);
  void look_with_calibration();
  void look_at_map(FrameId frame);
  void send(FrameId frame, MapperMessage message);
  std::shared_ptr<const PublishedMap> process(const MapTask& task);
  void add(const MapperMessage& message);
  bool is_due(FrameId frame) const;
  void finish_adjustment();
  void tell_motions();
  PublishedMap publish();

  // Fixed after construction.
  const std::shared_ptr<const Rig> given_rig_;
  const Settings settings_;
  const Timing timing_;
  const unsigned num_threads_;

  // The caller's thread.
  std::shared_ptr<const Rig> rig_;  // As calibrated so far.
  FrameBuilder builder_;
  FramesAhead ahead_;
  std::optional<Tracker> tracker_;
  TrajectoryMemory memory_;
  PublishedMap visible_;
  FrameId last_due_;  ///< The global adjustment that was asked for last.
  FrameDetails details_;
  SubmapId watched_submap_;  ///< Of the last frame with a pose.
  TrackingPurpose purpose_ = TrackingPurpose::kMapping;
  int num_relocalizations_ = 0;
  bool is_finished_ = false;
  std::shared_ptr<std::pmr::memory_resource> map_memory_;  ///< Null: the heap.

  // The mapper's thread, and the caller's once that has ended.
  GlobalMapper mapper_;
  const MarkerFinder marker_finder_;  // Any thread.
  AdjustmentWorker adjuster_;
  FrameId adjustment_due_;
  std::vector<double> mapping_ms_;
  MapSnapshot published_;

  // Written once by the mapper's thread, before the first map that has_focal_check() is published.
  std::optional<FocalCheck> focal_check_;
  bool is_focal_checked_ = false;  // The mapper's thread only.

  // Between the two; last, so that its thread ends before what it works on.
  MapWorker worker_;
};

TrackingResult System::Impl::feed(const FrameImages& images) {
  WAYMARK_CHECK(!is_finished_);
  const auto& past = memory_.entries();
  if (!past.empty() && images.timestamp_ns <= past.back().timestamp_ns) {
    throw InputError("frame " + std::to_string(past.size()),
                     "time stamp is not later than that of the frame before");
  }
  TrackingResult result;
  const FrameId id = memory_.next();
  if (!tracker_) make_tracker(!images.image1.is_empty() || !images.depth.is_empty());
  look_with_calibration();
  auto features = build(images, result.stages);
  result.num_features = static_cast<std::uint32_t>(features->num_primary);
  const Frame frame{id,
                    images.timestamp_ns,
                    std::move(features),
                    builder_.small_image(),
                    marker_finder_.search_in(images, rig_)};
  {
    StageTimer timer(result.stages, Stage::kWait);
    look_at_map(id);
  }
  TrackOutcome outcome = tracker_->track(frame, visible_.snapshot, result.stages);
  watch(images.image0, outcome, result.stages);
  memory_.add(frame, outcome, *map());
  num_relocalizations_ += outcome.is_relocalized;
  result.frame = FrameId{id.value - memory_.first().value};
  static_cast<FrameVerdict&>(result) = outcome;
  result.is_keyframe = outcome.message.has_value();
  result.is_relocalized = outcome.is_relocalized;
  if (outcome.message) {
    if (frame.find_markers) {
      StageTimer timer(result.stages, Stage::kKeyframe);
      marker_finder_.add_markers(frame, images, *rig_, *map(), outcome, *outcome.message);
    }
    // The mapper works in send() in kInline, and what kRealtime has to wait for is a sub-map.
    const bool is_submap = std::holds_alternative<NewSubmap>(*outcome.message);
    const bool waits = timing_ == Timing::kInline || (timing_ == Timing::kRealtime && is_submap);
    StageTimer timer(result.stages, waits ? Stage::kWait : Stage::kKeyframe);
    send(id, std::move(*outcome.message));
  }
  details_ = std::move(outcome.details);
  return result;
}

std::shared_ptr<const Features> System::Impl::build(const FrameImages& images, StageTimes& times) {
  const RigMotion motion = builder_.needs_motion(images) ? tracker_->predict_motion() : RigMotion{};
  std::optional<FoundFrame> found;
  {
    StageTimer timer(times, Stage::kWait);
    found = ahead_.take(images);
  }
  auto features =
      found ? builder_.build(*std::move(found), images, motion) : builder_.build(images, motion);
  times[Stage::kFeatures] = builder_.times().features_ms;
  times[Stage::kDepth] = builder_.times().depth_ms;
  return features;
}

void System::Impl::watch(ImageView image0, const TrackOutcome& outcome, StageTimes& times) {
  if (!outcome.world_from_rig) return;
  StageTimer timer(times, Stage::kFeatures);
  const Rigid3 world_from_cam = *outcome.world_from_rig * rig_->cameras[0].cam_from_rig.inverse();
  const FrameDetails& details = outcome.details;
  builder_.watch({image0, world_from_cam.rotation, *details.features, details.landmarks},
                 outcome.submap == watched_submap_);
  watched_submap_ = outcome.submap;
}

void System::Impl::make_tracker(bool has_range) {
  if (has_range) check_has_scale(*map());
  tracker_.emplace(rig_, has_range, settings_.tracking, static_cast<std::uint64_t>(settings_.seed));
  if (!map()->submaps().empty()) tracker_->begin_in(*map(), purpose_);
  tracker_->set_purpose(purpose_);
}

void System::Impl::keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory) {
  WAYMARK_CHECK(!tracker_);  // The mapper's thread has nothing to do yet.
  mapper_.keep_in(memory);
  map_memory_ = std::move(memory);
}

void System::Impl::set_mapping(bool is_on) {
  purpose_ = is_on ? TrackingPurpose::kMapping : TrackingPurpose::kLocalizing;
  if (tracker_) tracker_->set_purpose(purpose_);
}

std::unique_ptr<System::Impl> System::Impl::begin_anew() const {
  WAYMARK_CHECK(!is_finished_);
  auto anew = std::make_unique<Impl>(*given_rig_, settings_, timing_, nullptr, num_threads_);
  anew->purpose_ = purpose_;
  anew->keep_map_in(map_memory_);
  return anew;
}

/// Takes over the calibration of the map that the frame before saw.
void System::Impl::look_with_calibration() {
  const std::shared_ptr<const Rig>& rig = visible_.calibration.rig;
  if (!rig || rig == rig_) return;
  rig_ = rig;
  builder_.look_with(*rig_);
  tracker_->look_with(rig_);
  memory_.look_with(rig_);
}

void System::Impl::look_at_map(FrameId frame) {
  if (const auto published = worker_.for_frame(frame)) visible_ = *published;
  const FrameId due = visible_.adjustment_due;
  if (!due.is_valid() || due == last_due_) return;
  // In real time it is due once it is there.
  if (timing_ == Timing::kRealtime ? !adjuster_.has_result() : due > frame) return;
  last_due_ = due;
  worker_.send(FrameId{frame.value + 1}, {frame, std::nullopt});
}

void System::Impl::send(FrameId frame, MapperMessage message) {
  // A new sub-map is what the next frame is tracked in; a keyframe shows its effect later.
  const bool is_submap = std::holds_alternative<NewSubmap>(message);
  const auto latency = is_submap ? 1u : static_cast<std::uint32_t>(settings_.map_latency);
  worker_.send(FrameId{frame.value + latency}, {frame, std::move(message)});
  if (is_submap && timing_ == Timing::kRealtime) worker_.wait();
}

std::shared_ptr<const PublishedMap> System::Impl::process(const MapTask& task) {
  if (task.message) {
    add(*task.message);
    published_ = mapper_.snapshot();
  } else if (is_due(task.frame)) {
    finish_adjustment();
  }
  // A loop does not wait for an estimate that it makes out of date.
  if (adjuster_.is_busy_with_calibration() && mapper_.has_loop_task()) adjuster_.finish();
  if (!adjuster_.is_busy()) {
    if (auto adjustment = mapper_.take_task()) {
      adjuster_.start(*std::move(adjustment));
      adjustment_due_ =
          FrameId{task.frame.value + static_cast<std::uint32_t>(settings_.global_latency)};
    }
  }
  return std::make_shared<const PublishedMap>(publish());
}

/// Not if the adjustment that was asked for has been dropped, and another one begun.
bool System::Impl::is_due(FrameId frame) const {
  return adjuster_.is_busy() && (timing_ == Timing::kRealtime || adjustment_due_ <= frame);
}

PublishedMap System::Impl::publish() {
  return {published_, mapper_.calibration(), adjustment_due_, mapper_.num_loops(), mapping_ms_};
}

void System::Impl::finish_adjustment() {
  const AdjustmentWorker::Result result = adjuster_.finish();
  adjustment_due_ = FrameId{};
  // The tracker goes on with the very map that it has where nothing came of it.
  if (result.task.is_for_calibration && !result.adjustment.calibration) return;
  mapper_.apply(result.task, result.adjustment);
  published_ = mapper_.snapshot();
}

void System::Impl::add(const MapperMessage& message) {
  const auto start = std::chrono::steady_clock::now();
  std::visit([&](const auto& content) { mapper_.add(content); }, message);
  mapping_ms_.push_back(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  if (is_focal_checked_ || !has_focal_check(mapper_.map(), memory_.first())) return;
  is_focal_checked_ = true;
  focal_check_ = check_focal_length(mapper_.map());
}

std::vector<CalibrationEstimate> System::Impl::calibration() const {
  const KnownCalibration& known = visible_.calibration;
  return known.is_changed() ? known.estimates() : std::vector<CalibrationEstimate>{};
}

const FocalCheck* System::Impl::focal_check() const {
  // The map first: seeing it is what makes the result readable here.
  if (!is_finished_ && !has_focal_check(*map(), memory_.first())) return nullptr;
  return focal_check_ ? &*focal_check_ : nullptr;
}

void System::Impl::finish() {
  if (is_finished_) return;
  is_finished_ = true;
  try {
    worker_.finish();
  } catch (...) {
    adjuster_.stop();  // What may be short, memory above all, is needed to save what there is.
    throw;
  }
  if (adjuster_.is_busy()) finish_adjustment();
  tell_motions();
  mapper_.finish();
  published_ = mapper_.snapshot();
  visible_ = publish();
  look_with_calibration();
  memory_.settle(*map());
  const bool is_long = memory_.entries().size() >= kFramesToCheck;
  if (is_long && !is_focal_checked_) focal_check_ = check_focal_length(*map());
}

void System::Impl::drop_seen_through() {
  WAYMARK_CHECK(is_finished_);
  mapper_.drop_seen_through();
  published_ = mapper_.snapshot();
  visible_ = publish();
}

void System::Impl::tell_motions() {
  if (!settings_.calibration.is_refined() && given_rig_->cameras[0].readout_s == 0.0) return;
  for (const auto& [id, motion] : list_motions(memory_, *mapper_.snapshot().map)) {
    mapper_.set_motion(id, motion);
  }
}

SystemStatistics System::Impl::statistics() const {
  SystemStatistics statistics;
  statistics.num_keyframes = static_cast<int>(map()->keyframes().size());
  statistics.num_landmarks = static_cast<int>(map()->landmarks().size());
  for (const Submap& submap : map()->submaps()) {
    statistics.num_submaps += !submap.joined_into.is_valid();
  }
  statistics.num_loops = visible_.num_loops;
  statistics.num_relocalizations = num_relocalizations_;
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
TrackingResult System::feed(const FrameImages& images) { return impl_->feed(images); }
void System::prepare(const FrameImages& images, std::shared_ptr<const void> owner) {
  impl_->prepare(images, std::move(owner));
}
std::size_t System::max_prepared() const { return impl_->max_prepared(); }
void System::finish() { impl_->finish(); }
void System::drop_seen_through() { impl_->drop_seen_through(); }
void System::keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory) {
  impl_->keep_map_in(std::move(memory));
}
void System::set_mapping(bool is_on) { impl_->set_mapping(is_on); }
void System::reset() { impl_ = impl_->begin_anew(); }
std::vector<TrajectoryFrame> System::trajectory() const { return impl_->trajectory(); }
std::vector<FrameState> System::frame_states() const { return impl_->frame_states(); }
std::vector<KeptScale> System::kept_scales() const { return impl_->kept_scales(); }
const FocalCheck* System::focal_check() const { return impl_->focal_check(); }
MarkerReport System::markers() const { return impl_->markers(); }
Image System::ego_mask() const { return impl_->ego_mask(); }
std::shared_ptr<const Rig> System::rig() const { return impl_->rig(); }
std::vector<CalibrationEstimate> System::calibration() const { return impl_->calibration(); }
const FrameDetails& System::details() const { return impl_->details(); }
std::shared_ptr<const Map> System::map() const { return impl_->map(); }
SystemStatistics System::statistics() const { return impl_->statistics(); }

}  // namespace waymark
