// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "live_control.h"

#include <chrono>
#include <thread>
#include <utility>

#include "waymark/input/imu_stream.h"

namespace waymark {
namespace {

using namespace std::chrono_literals;

constexpr auto kPollInterval = 20ms;

}  // namespace

LiveControl::LiveControl(const ViewerOptions& options, SessionInfo info, Reporter& reporter)
    : info_(std::move(info)), viewer_(options, info_), reporter_(reporter) {
  prepare("opening the input");
}

CalibrateOptions LiveControl::shown(CalibrateOptions options) {
  options.on_progress = [this, tell = std::move(options.on_progress)](const std::string& text) {
    tell(text);
    prepare(text);
  };
  options.should_stop = [this, is_over = std::move(options.should_stop)] {
    take_requests();
    return is_stopped_ || is_over();
  };
  return options;
}

void LiveControl::prepare(const std::string& doing) {
  ViewUpdate update;
  update.status.doing = doing;
  viewer_.try_push(update);
}

void LiveControl::begin(const ControlledParts& parts, const InputInfo& input) {
  info_.setup = to_string(input.setup);
  parts_.emplace(parts);
  const bool is_again = publisher_.has_value();
  publisher_.emplace(viewer_, input.num_frames, info_);
  if (input.imu) publisher_->leave_out_imu(fault_of(*input.imu));
  if (is_again) publisher_->reset();
}

void LiveControl::show(const FrameImages& input, const TrackingResult& result) {
  publisher_->tell(parts_->system, input, result);
}

void LiveControl::show(const FrameRecord& record) {
  const bool was_fed =
      record.state != FrameState::kUnreadable && record.state != FrameState::kDropped;
  if (!was_fed) publisher_->skip(record);
}

bool LiveControl::should_stop(const std::function<bool()>& is_interrupted) {
  take_requests();
  while (parts_->is_paused && !is_stopped_ && !is_interrupted()) {
    std::this_thread::sleep_for(kPollInterval);
    parts_->autosave.update(parts_->system.map(), parts_->system.inertial());
    take_requests();
  }
  return is_stopped_ || is_interrupted();
}

void LiveControl::take_requests() {
  while (const std::optional<ViewRequest> request = viewer_.next_request()) answer(*request);
  tell_problem();
}

void LiveControl::tell_problem() {
  if (const auto problem = viewer_.next_problem()) reporter_.warning("viewer: " + *problem);
}

void LiveControl::answer(const ViewRequest& request) {
  if (!parts_) {  // All else is refused by the viewer.
    is_stopped_ |= request.kind == ViewRequest::Kind::kStop;
    return;
  }
  switch (request.kind) {
    case ViewRequest::Kind::kPause:
      parts_->is_paused = true;
      publisher_->set_phase(SessionPhase::kPaused);
      break;
    case ViewRequest::Kind::kResume:
      parts_->is_paused = false;
      publisher_->set_phase(SessionPhase::kRunning);
      break;
    case ViewRequest::Kind::kReset:
      parts_->system.reset();
      parts_->images.begin_anew();
      publisher_->reset();
      if (parts_->is_paused) publisher_->set_phase(SessionPhase::kPaused);
      break;
    case ViewRequest::Kind::kMappingOn:
    case ViewRequest::Kind::kMappingOff: {
      const bool is_on = request.kind == ViewRequest::Kind::kMappingOn;
      parts_->system.set_mapping(is_on);
      publisher_->set_mapping(is_on);
      break;
    }
    case ViewRequest::Kind::kSave:
      save(request);
      break;
    case ViewRequest::Kind::kStop:
      is_stopped_ = true;
      break;
    case ViewRequest::Kind::kImage:
      send_image(request);
      break;
    case ViewRequest::Kind::kScale:  // Of a saved map only.
      break;
  }
}

void LiveControl::send_image(const ViewRequest& request) {
  const Keyframe* keyframe = parts_->system.map()->keyframes().find(request.keyframe);
  viewer_.reply(
      {request, "", "", keyframe ? parts_->images.image_of(request.keyframe, *keyframe) : nullptr});
}

void LiveControl::save(const ViewRequest& request) {
  if (parts_->system.map()->keyframes().is_empty()) {
    viewer_.reply({request, "", "there is no map yet"});
    return;
  }
  parts_->autosave.save_soon([this, request](const std::string& error) {
    viewer_.reply({request, error.empty() ? parts_->autosave.path().string() : "", error});
  });
}

}  // namespace waymark
