// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/workers.h"

#include <algorithm>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

constexpr std::size_t kInboxCapacity = 8;

AdjustmentWorker::Result adjust(AdjustmentTask task) {
  GlobalAdjustment adjustment = task.adjust();
  return {std::move(task), std::move(adjustment)};
}

}  // namespace

MapWorker::MapWorker(Timing timing, Work work)
    : timing_(timing), work_(std::move(work)), feed_(timing), inbox_(kInboxCapacity) {
  if (timing_ != Timing::kInline) thread_ = std::jthread([this] { run(); });
}

MapWorker::~MapWorker() { stop(); }

void MapWorker::send(FrameId visible_from, MapTask task) {
  last_visible_from_ = std::max(last_visible_from_, visible_from);
  feed_.expect(last_visible_from_);
  Delivery delivery{last_visible_from_, std::move(task), false};
  if (timing_ == Timing::kInline) {
    process(delivery);
  } else {
    inbox_.push(std::move(delivery));  // Refused only after a failure, which for_frame() tells.
  }
}

std::shared_ptr<const PublishedMap> MapWorker::for_frame(FrameId frame) {
  return feed_.for_frame(frame);
}

void MapWorker::wait() {
  if (timing_ == Timing::kInline) return;
  if (inbox_.push({last_visible_from_, {}, true})) done_.pop();
}

void MapWorker::finish() {
  stop();
  feed_.for_frame(FrameId{UINT32_MAX - 1});  // Rethrows what failed in the thread.
}

void MapWorker::process(const Delivery& delivery) {
  feed_.publish(delivery.visible_from, work_(delivery.task));
}

void MapWorker::run() {
  try {
    while (const auto delivery = inbox_.pop()) {
      if (delivery->is_wait) {
        done_.push(true);
      } else {
        process(*delivery);
      }
    }
  } catch (...) {
    inbox_.close();
    feed_.fail(std::current_exception());
  }
  done_.close();
}

void MapWorker::stop() {
  inbox_.close();
  if (thread_.joinable()) thread_.join();
}

AdjustmentWorker::AdjustmentWorker(Timing timing) : timing_(timing) {
  if (timing_ != Timing::kInline) thread_ = std::jthread([this] { run(); });
}

AdjustmentWorker::~AdjustmentWorker() { stop(); }

void AdjustmentWorker::stop() {
  tasks_.close();
  outcomes_.close();
  if (thread_.joinable()) thread_.join();
}

void AdjustmentWorker::start(AdjustmentTask task) {
  WAYMARK_CHECK(!is_busy_);
  is_busy_ = true;
  is_for_calibration_ = task.is_for_calibration;
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
