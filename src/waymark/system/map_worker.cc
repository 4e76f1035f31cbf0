// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/map_worker.h"

#include <algorithm>
#include <utility>

namespace waymark {
namespace {

constexpr std::size_t kInboxCapacity = 8;

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

}  // namespace waymark
