// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>

#include "reporter.h"
#include "waymark/calibrate/calibrate.h"
#include "waymark/session/autosave.h"
#include "waymark/session/frame_feed.h"
#include "waymark/session/keyframe_image_cache.h"
#include "waymark/system/system.h"
#include "waymark/view/publisher.h"
#include "waymark/view/viewer.h"

namespace waymark {

/// What of a session follows what people ask for.
struct ControlledParts {
  System& system;
  Autosave& autosave;
  KeyframeImageCache& images;
  std::atomic<bool>& is_paused;  ///< Read by the thread that reads the input, too.
};

/// Shows a running session in the browser and does what people ask for there. The page is there
/// before the session is: opening the input and finding its calibration may take long.
class LiveControl {
 public:
  LiveControl(const ViewerOptions& options, SessionInfo info, Reporter& reporter);
  ~LiveControl() { tell_problem(); }
  LiveControl(const LiveControl&) = delete;
  LiveControl& operator=(const LiveControl&) = delete;

  std::string url() const { return viewer_.url(); }
  /// Lets the page tell what a calibration does, and end it.
  CalibrateOptions shown(CalibrateOptions options);
  /// The session begins, in place of the one before; it is used until its input ends or finish().
  void begin(const ControlledParts& parts, const InputInfo& input);
  /// A frame was fed.
  void show(const FrameImages& input, const TrackingResult& result);
  /// A frame is done; for those that were not fed.
  void show(const FrameRecord& record);
  /// Does what was asked for since; while paused it only returns to say that all is over.
  bool should_stop(const std::function<bool()>& is_interrupted);
  bool is_stopped() const { return is_stopped_; }
  void finishing() { publisher_->set_phase(SessionPhase::kFinishing); }
  void finish() { publisher_->finish(parts_->system); }

 private:
  /// Tells what is done before there is a session.
  void prepare(const std::string& doing);
  void take_requests();
  /// Warns of what went wrong in the viewer, if anything did.
  void tell_problem();
  void answer(const ViewRequest& request);
  void save(const ViewRequest& request);
  void send_image(const ViewRequest& request);

  SessionInfo info_;
  Viewer viewer_;
  std::optional<ControlledParts> parts_;  ///< Nothing: there is no session yet.
  std::optional<ViewPublisher> publisher_;
  Reporter& reporter_;
  bool is_stopped_ = false;
};

}  // namespace waymark
