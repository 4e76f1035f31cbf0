// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "waymark/base/feed.h"
#include "waymark/base/mailbox.h"
#include "waymark/base/timing.h"
#include "waymark/loop/global_mapper.h"
#include "waymark/map/messages.h"
#include "waymark/place/map_snapshot.h"

namespace waymark {

/// What the mapper is to do at a frame: take in a message, or move a part of the map, or, without
/// either, take in the global adjustment that is due.
struct MapTask {
  FrameId frame;
  std::optional<MapperMessage> message;
  std::optional<SubmapPlacement> placement = std::nullopt;
};

/// What the mapper shows after a task.
struct PublishedMap {
  MapSnapshot snapshot;
  KnownCalibration calibration;  ///< That the map is measured with.
  FrameId adjustment_due;  ///< When a global adjustment is to be taken in; invalid if none runs.
  int num_loops = 0;       ///< Closed so far.
  std::vector<double> mapping_ms;            ///< Of each message so far.
  std::optional<SubmapPlacement> placement;  ///< By an IMU, where there was one.
};

/// Takes tasks to the mapper, in a thread of its own unless the timing is kInline,
/// and shows the maps that come of them at fixed frames. What the work throws reaches the caller:
/// at once from send() in kInline, else from the next for_frame() that has to wait or from
/// finish().
class MapWorker {
 public:
  /// The map after a task; called for one task after the other, in order.
  using Work = std::function<std::shared_ptr<const PublishedMap>(const MapTask&)>;

  MapWorker(Timing timing, Work work);
  ~MapWorker();
  MapWorker(const MapWorker&) = delete;
  MapWorker& operator=(const MapWorker&) = delete;

  /// The effect of the task shows from this frame on, but not before that of an earlier task.
  void send(FrameId visible_from, MapTask task);
  /// The newest map that a frame may see, null before the first; frames ascend.
  std::shared_ptr<const PublishedMap> for_frame(FrameId frame);
  /// Waits until all tasks sent so far are done. for_frame() tells of a failure.
  void wait();
  /// Waits until all tasks are done and ends the thread. No send() afterwards.
  void finish();

 private:
  struct Delivery {
    FrameId visible_from;
    MapTask task;
    bool is_wait = false;  ///< Without a task: to be answered.
  };

  void process(const Delivery& delivery);
  void run();
  void stop();

  const Timing timing_;
  const Work work_;
  FrameId last_visible_from_{0};
  Feed<PublishedMap> feed_;
  Mailbox<Delivery> inbox_;
  Mailbox<bool> done_{1};  ///< Answers wait().
  std::jthread thread_;
};

/// Adjusts sub-maps beside the mapper, one at a time, in a thread of its own unless the timing is
/// kInline. Used by the mapper's thread alone.
class AdjustmentWorker {
 public:
  struct Result {
    AdjustmentTask task;
    GlobalAdjustment adjustment;
  };

  explicit AdjustmentWorker(Timing timing);
  ~AdjustmentWorker();
  AdjustmentWorker(const AdjustmentWorker&) = delete;
  AdjustmentWorker& operator=(const AdjustmentWorker&) = delete;

  bool is_busy() const { return is_busy_; }
  /// Whether what it is busy with may be dropped where there is something better to do.
  bool is_busy_with_calibration() const { return is_busy_ && is_for_calibration_; }
  /// Begins the task; must not be busy.
  void start(AdjustmentTask task);
  /// Whether finish() would not wait; for any thread.
  bool has_result() const { return outcomes_.size() > 0; }
  /// Waits for the result of the task that was started. Rethrows what failed.
  Result finish();
  /// Ends the thread once it is done with its task, whose result is lost. No start() afterwards.
  void stop();

 private:
  struct Outcome {
    Result result;
    std::exception_ptr error;
  };

  void run();

  const Timing timing_;
  bool is_busy_ = false;
  bool is_for_calibration_ = false;
  Mailbox<AdjustmentTask> tasks_{1};
  Mailbox<Outcome> outcomes_{1};
  std::jthread thread_;
};

}  // namespace waymark
