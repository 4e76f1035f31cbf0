// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shows a session in a viewer, frame by frame.
//
//   ViewPublisher publisher(viewer, input.info().num_frames);
//   const TrackingResult& result = system.feed(images);
//   publisher.tell(system, images, result);
//   publisher.finish(system);

#include <chrono>
#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "waymark/system/system.h"
#include "waymark/view/viewer.h"

namespace waymark {

/// Tells a viewer of a session, frame by frame, from the session's thread. Costs that thread some
/// pointers, the notes of the frame and, ten times per second at most, a copy of the image.
class ViewPublisher {
 public:
  /// num_frames_total: of the input, if it is known. info: where the viewer knew less when it
  /// began.
  ViewPublisher(ViewChannel& channel,
                std::optional<std::size_t> num_frames_total,
                std::optional<SessionInfo> info = std::nullopt);
  /// To a viewer, which lives longer.
  ViewPublisher(Viewer& viewer,
                std::optional<std::size_t> num_frames_total,
                std::optional<SessionInfo> info = std::nullopt)
      : ViewPublisher(viewer.channel(), num_frames_total, std::move(info)) {}

  /// The session has an IMU whose samples are not fed, for this reason.
  void leave_out_imu(std::string reason) { imu_fault_ = std::move(reason); }
  /// A frame was fed; input is what was fed.
  void tell(const System& system, const FrameImages& input, const TrackingResult& result);
  /// A frame was not fed.
  void skip(const FrameStatus& newest);
  /// Where the session is in its course.
  void set_phase(SessionPhase phase);
  /// Whether the map grows.
  void set_mapping(bool is_on);
  /// The session began anew; whatever came before is void.
  void reset();
  /// The session is over: tells the final poses of all frames.
  void finish(const System& system);

 private:
  using Clock = std::chrono::steady_clock;

  void note_frames(const FrameImages& input, const TrackingResult& result);
  void count(const FrameStatus& newest);
  void measure(const TrackingResult& result);
  void note_calibration(const System& system);
  void note_imu(const System& system);
  void push();

  ViewChannel& channel_;
  ViewUpdate update_;  ///< Not taken in by the viewer yet.
  std::string imu_fault_;
  FrameId first_frame_;
  std::shared_ptr<const Rig> rig_;          ///< That the status tells of.
  std::deque<std::int64_t> timestamps_ns_;  ///< Of all frames fed.
  std::deque<float> recent_tracking_ms_;
  std::deque<Clock::time_point> recent_times_;
};

}  // namespace waymark
