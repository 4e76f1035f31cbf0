// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Maps an input and shows it in the browser while it does, with the controls of the page.
//
//   waymark_example_live_view INPUT PORT [CAMCHAIN.yaml]
//
// A Viewer serves the page in a thread of its own and is never waited for; a ViewPublisher tells it
// of each frame. What people ask for on the page waits until next_request() is called. The page
// stays until the standard input ends: Ctrl-D.
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/calibrate/calibrate.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/input.h"
#include "waymark/system/system.h"
#include "waymark/view/publisher.h"
#include "waymark/view/viewer.h"

namespace {

using namespace waymark;
using Request = ViewRequest::Kind;

/// With the cameras of the input itself, of a file, or as its images tell.
std::unique_ptr<Input> open(const char* path, const char* camchain) {
  InputOptions options;
  if (camchain) {
    options.calibration = read_camchain(parse_config(ConfigSource::from_file(camchain)));
  }
  std::unique_ptr<Input> input = open_input(path, options);
  if (input->info().calibration) return input;
  options.calibration = calibrate(*input, CalibrateOptions()).chain();
  input.reset();  // A camera is open once at a time.
  return open_input(path, options);
}

/// The session and its page.
class LiveSession {
 public:
  LiveSession(const Input& input, const char* path, const char* port)
      : system_(make_rig(*input.info().calibration), Settings(), Timing::kLockstep),
        viewer_(parse_viewer_address(port, "PORT"), describe(input.info(), path)),
        publisher_(viewer_, input.info().num_frames) {
    std::printf("open %s in a browser\n", viewer_.url().c_str());
    std::fflush(stdout);
  }

  void feed(const InputFrame& images) {
    FrameImages frame;
    frame.timestamp_ns = images.timestamp_ns;
    frame.image0 = images.images[0].view();
    if (images.images.size() > 1) frame.image1 = images.images[1].view();
    if (images.depth) frame.depth = images.depth->view();
    publisher_.tell(system_, frame, system_.feed(frame));
  }

  /// Does what people asked for since; false once they ended the session.
  bool goes_on() {
    do {
      while (const std::optional<ViewRequest> request = viewer_.next_request()) act(request->kind);
      if (is_paused_) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    } while (is_paused_ && !is_over_);
    return !is_over_;
  }

  void finish() {
    publisher_.set_phase(SessionPhase::kFinishing);
    system_.finish();
    publisher_.finish(system_);
    std::printf("%zu keyframes\n", system_.map()->keyframes().size());
    std::fflush(stdout);
  }

 private:
  static SessionInfo describe(const InputInfo& input, const char* path) {
    SessionInfo info;
    info.program = "live_view";
    info.input = path;
    info.setup = to_string(input.setup);
    return info;
  }

  void act(Request request) {
    if (request == Request::kStop) is_over_ = true;
    if (request == Request::kPause || request == Request::kResume) {
      is_paused_ = request == Request::kPause;
      publisher_.set_phase(is_paused_ ? SessionPhase::kPaused : SessionPhase::kRunning);
    }
    if (request == Request::kMappingOn || request == Request::kMappingOff) {
      system_.set_mapping(request == Request::kMappingOn);
      publisher_.set_mapping(request == Request::kMappingOn);
    }
    if (request == Request::kReset) {
      system_.reset();
      publisher_.reset();
    }
  }

  System system_;
  Viewer viewer_;
  ViewPublisher publisher_;
  bool is_paused_ = false;
  bool is_over_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: %s INPUT PORT [CAMCHAIN.yaml]\n", argv[0]);
    return 2;
  }
  try {
    const std::unique_ptr<Input> input = open(argv[1], argc == 4 ? argv[3] : nullptr);
    LiveSession session(*input, argv[1], argv[2]);
    while (session.goes_on()) {
      const std::optional<InputFrame> images = input->next();
      if (!images) break;
      if (images->fault == FrameFault::kNone) session.feed(*images);
    }
    session.finish();
    while (std::getchar() != EOF) continue;
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
