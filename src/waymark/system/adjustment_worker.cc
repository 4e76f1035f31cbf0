// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/adjustment_worker.h"

#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

AdjustmentWorker::Result adjust(AdjustmentTask task) {
  GlobalAdjustment adjustment = adjust_globally(*task.map, task.submap);
  return {std::move(task), std::move(adjustment)};
}

}  // namespace

AdjustmentWorker::AdjustmentWorker(Timing timing) : timing_(timing) {
  if (timing_ != Timing::kInline) thread_ = std::jthread([this] { run(); });
}

AdjustmentWorker::~AdjustmentWorker() {
  tasks_.close();
  outcomes_.close();
}

void AdjustmentWorker::start(AdjustmentTask task) {
  WAYMARK_CHECK(!is_busy_);
  is_busy_ = true;
  tasks_.push(std::move(task));
}

AdjustmentWorker::Result AdjustmentWorker::finish() {
  WAYMARK_CHECK(is_busy_);
  is_busy_ = false;
  if (timing_ == Timing::kInline) return adjust(*tasks_.pop());
  Outcome outcome = *outcomes_.pop();
  if (outcome.error) std::rethrow_exception(outcome.error);
  return std::move(outcome.result);
}

void AdjustmentWorker::run() {
  while (std::optional<AdjustmentTask> task = tasks_.pop()) {
    Outcome outcome;
    try {
      outcome.result = adjust(*std::move(task));
    } catch (...) {
      outcome.error = std::current_exception();
    }
    outcomes_.push(std::move(outcome));
  }
}

}  // namespace waymark
