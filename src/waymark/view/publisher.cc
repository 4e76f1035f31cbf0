// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/publisher.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/view/hub.h"

namespace waymark {
namespace {

/// Frames that the median of the tracking time and the frame rate are taken of.
constexpr std::size_t kRecent = 99;

Image copy_of(const ImageView& view) {
  Image image(view.width_px, view.height_px);
  for (int y = 0; y < view.height_px; ++y) {
    std::memcpy(image.row(y), view.row(y), static_cast<std::size_t>(view.width_px));
  }
  return image;
}

/// Darkens what is not used: where the mask, which may be empty, is 0.
void darken(const ImageView& mask, Image& image) {
  for (int y = 0; y < mask.height_px; ++y) {
    for (int x = 0; x < mask.width_px; ++x) {
      if (mask.at(x, y) == 0) image.row(y)[x] /= 3;
    }
  }
}

Image drawn_image(const System& system, const FrameImages& input) {
  Image image = copy_of(input.image0);
  darken(input.mask, image);
  darken(system.ego_mask().view(), image);
  return image;
}

FeatureColors colors_of(const TrackingResult& result, const ImageView& image) {
  FeatureColors colors;
  colors.frame = result.frame_in_map;
  colors.rgb.reserve(result.features->num_primary);
  for (std::size_t i = 0; i < result.features->num_primary; ++i) {
    const Keypoint& keypoint = result.features->keypoints[i];
    const int x = std::clamp(static_cast<int>(keypoint.x_px + 0.5f), 0, image.width_px - 1);
    const int y = std::clamp(static_cast<int>(keypoint.y_px + 0.5f), 0, image.height_px - 1);
    const std::uint8_t grey = image.at(x, y);
    colors.rgb.push_back({grey, grey, grey});
  }
  return colors;
}

}  // namespace

ViewPublisher::ViewPublisher(ViewChannel& channel,
                             std::optional<std::size_t> num_frames_total,
                             std::optional<SessionInfo> info)
    : channel_(channel) {
  update_.info = std::move(info);
  update_.status.num_frames_total = num_frames_total;
  push();
}

void ViewPublisher::tell(const System& system,
                         const FrameImages& input,
                         const TrackingResult& result) {
  SessionStatus& status = update_.status;
  if (status.phase == SessionPhase::kStarting) status.phase = SessionPhase::kRunning;
  if (timestamps_ns_.empty()) first_frame_ = result.frame_in_map;
  timestamps_ns_.push_back(input.timestamp_ns);
  status.frame = result.frame_in_map;
  status.time_s = 1e-9 * static_cast<double>(input.timestamp_ns - timestamps_ns_.front());
  measure(result);
  count(result);
  update_.map = system.map();
  note_calibration(system);
  note_imu(system);
  note_frames(input, result);
  update_.colors.push_back(colors_of(result, input.image0));
  if (channel_.wants_image.exchange(false, std::memory_order_relaxed)) {
    update_.image = std::make_shared<const DrawnFrame>(DrawnFrame{result.frame_in_map,
                                                                  input.timestamp_ns,
                                                                  input.image0.width_px,
                                                                  input.image0.height_px,
                                                                  result.features,
                                                                  result.landmarks,
                                                                  drawn_image(system, input)});
  }
  push();
}

void ViewPublisher::note_frames(const FrameImages& input, const TrackingResult& result) {
  update_.frames.push_back({result,
                            result.frame_in_map,
                            input.timestamp_ns,
                            static_cast<float>(result.stages.tracking_ms()),
                            result.world_from_rig ? std::optional(result.pose) : std::nullopt});
  for (const FilledPose& filled : result.filled) {
    update_.frames.push_back({{.state = FrameState::kFilled},
                              filled.frame,
                              timestamps_ns_.at(filled.frame.value - first_frame_.value),
                              0.0f,
                              filled.pose});
  }
  update_.status.num_tracked += result.filled.size();
}

/// Every estimate of the calibration is another rig.
void ViewPublisher::note_calibration(const System& system) {
  if (const auto rig = system.rig(); rig == std::exchange(rig_, rig)) return;
  std::vector<CalibrationEstimate>& calibration = update_.status.calibration;
  calibration = system.calibration();
  std::erase_if(calibration, [](const auto& estimate) { return !estimate.is_changed(); });
}

void ViewPublisher::note_imu(const System& system) {
  ImuStatus imu = {.rate_hz = system.imu_rate_hz(), .reason = imu_fault_};
  if (!imu.rate_hz && imu_fault_.empty()) return;
  if (const std::optional<InertialReport>& report = system.inertial()) {
    imu.is_used = report->is_used;
    imu.reason = report->reason;
    imu.submap = report->submap;
    if (report->metric_from) imu.metric_submap = report->metric_submap;
    // Where a part was joined to another it lies otherwise from then on.
    const bool is_joined = update_.map->submaps()[imu.submap.value].joined_into.is_valid();
    if (imu.is_used && !is_joined) imu.gravity = report->gravity_in_world.normalized();
  }
  update_.status.imu = std::move(imu);
}

void ViewPublisher::count(const FrameStatus& newest) {
  SessionStatus& status = update_.status;
  ++status.num_frames;
  status.num_tracked += newest.state == FrameState::kTracked;
  status.num_unreadable += newest.state == FrameState::kUnreadable;
  status.num_dropped += newest.state == FrameState::kDropped;
  status.lost_count +=
      newest.state == FrameState::kLost && status.newest.state != FrameState::kLost;
  status.newest = newest;
}

void ViewPublisher::measure(const TrackingResult& result) {
  SessionStatus& status = update_.status;
  status.stages = result.stages;
  recent_tracking_ms_.push_back(static_cast<float>(result.stages.tracking_ms()));
  recent_times_.push_back(Clock::now());
  if (recent_times_.size() > kRecent) {
    recent_tracking_ms_.pop_front();
    recent_times_.pop_front();
  }
  status.median_tracking_ms = static_cast<double>(
      median(std::vector<float>(recent_tracking_ms_.begin(), recent_tracking_ms_.end())));
  const std::chrono::duration<double> span = recent_times_.back() - recent_times_.front();
  status.frames_per_s =
      span.count() > 0.0 ? static_cast<double>(recent_times_.size() - 1) / span.count() : 0.0;
}

void ViewPublisher::skip(const FrameStatus& newest) {
  count(newest);
  push();
}

void ViewPublisher::set_phase(SessionPhase phase) {
  if (update_.status.phase == phase) return;
  update_.status.phase = phase;
  push();
}

void ViewPublisher::set_mapping(bool is_on) {
  update_.status.is_mapping = is_on;
  push();
}

void ViewPublisher::reset() {
  const std::optional<std::size_t> total = update_.status.num_frames_total;
  std::optional<SessionInfo> info = std::move(update_.info);
  update_ = ViewUpdate();
  update_.is_reset = true;
  update_.info = std::move(info);
  update_.map = std::make_shared<const Map>();
  update_.status.num_frames_total = total;
  timestamps_ns_.clear();
  recent_tracking_ms_.clear();
  recent_times_.clear();
  push();
}

void ViewPublisher::finish(const System& system) {
  SessionStatus& status = update_.status;
  status.phase = SessionPhase::kDone;
  status.num_tracked = 0;
  update_.map = system.map();
  note_calibration(system);
  note_imu(system);
  for (const TrajectoryFrame& frame : system.trajectory()) {
    update_.frames.push_back({{.state = frame.state, .submap = frame.submap},
                              FrameId{first_frame_.value + frame.frame.value},
                              frame.timestamp_ns,
                              0.0f,
                              {},
                              frame.world_from_rig});
    ++status.num_tracked;
  }
  push();
}

void ViewPublisher::push() {
  const SessionStatus status = update_.status;
  if (!channel_.updates.try_push(update_)) return;  // It goes with the next one.
  update_ = ViewUpdate();
  update_.status = status;
}

}  // namespace waymark
