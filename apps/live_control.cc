// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "live_control.h"

#include <chrono>
#include <thread>
#include <utility>

namespace waymark {
namespace {

using namespace std::chrono_literals;

constexpr auto kPollInterval = 20ms;

}  // namespace

LiveControl::LiveControl(const ViewerOptions& options,
                         SessionInfo info,
                         System& system,
                         const ControlledParts& parts,
                         std::optional<std::size_t> num_frames,
                         Reporter& reporter)
    : system_(system),
      parts_(parts),
      viewer_(options, std::move(info)),
      publisher_(viewer_, num_frames),
      reporter_(reporter) {}

void LiveControl::show(const FrameImages& input, const TrackingResult& result) {
  publisher_.tell(system_, input, result);
}

void LiveControl::show(const FrameRecord& record) {
  const bool was_fed =
      record.state != FrameState::kUnreadable && record.state != FrameState::kDropped;
  if (!was_fed) publisher_.skip(record);
}

bool LiveControl::should_stop(const std::function<bool()>& is_interrupted) {
  take_requests();
  while (parts_.is_paused && !is_stopped_ && !is_interrupted()) {
    std::this_thread::sleep_for(kPollInterval);
    parts_.autosave.update(system_.map());
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
  switch (request.kind) {
    case ViewRequest::Kind::kPause:
      parts_.is_paused = true;
      publisher_.set_phase(SessionPhase::kPaused);
      break;
    case ViewRequest::Kind::kResume:
      parts_.is_paused = false;
      publisher_.set_phase(SessionPhase::kRunning);
      break;
    case ViewRequest::Kind::kReset:
      system_.reset();
      parts_.images.begin_anew();
      publisher_.reset();
      if (parts_.is_paused) publisher_.set_phase(SessionPhase::kPaused);
      break;
    case ViewRequest::Kind::kMappingOn:
    case ViewRequest::Kind::kMappingOff: {
      const bool is_on = request.kind == ViewRequest::Kind::kMappingOn;
      system_.set_mapping(is_on);
      publisher_.set_mapping(is_on);
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
  const Keyframe* keyframe = system_.map()->keyframes().find(request.keyframe);
  viewer_.reply(
      {request, "", "", keyframe ? parts_.images.image_of(request.keyframe, *keyframe) : nullptr});
}

void LiveControl::save(const ViewRequest& request) {
  if (system_.map()->keyframes().is_empty()) {
    viewer_.reply({request, "", "there is no map yet"});
    return;
  }
  parts_.autosave.save_soon([this, request](const std::string& error) {
    viewer_.reply({request, error.empty() ? parts_.autosave.path().string() : "", error});
  });
}

}  // namespace waymark
