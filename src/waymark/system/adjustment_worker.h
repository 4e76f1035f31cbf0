// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <optional>
#include <thread>

#include "waymark/base/mailbox.h"
#include "waymark/base/timing.h"
#include "waymark/loop/global_mapper.h"

namespace waymark {

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
  /// Begins the task; must not be busy.
  void start(AdjustmentTask task);
  /// Whether finish() would not wait; for any thread.
  bool has_result() const { return outcomes_.size() > 0; }
  /// Waits for the result of the task that was started. Rethrows what failed.
  Result finish();

 private:
  struct Outcome {
    Result result;
    std::exception_ptr error;
  };

  void run();

  const Timing timing_;
  bool is_busy_ = false;
  Mailbox<AdjustmentTask> tasks_{1};
  Mailbox<Outcome> outcomes_{1};
  std::jthread thread_;
};

}  // namespace waymark
