// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/live_input.h"

#include <utility>

namespace waymark {
namespace {

/// So many frames may wait: one slow frame does not cost the next ones.
constexpr std::size_t kMaxWaiting = 2;

void drop(InputFrame& frame) {
  frame.fault = FrameFault::kLate;
  frame.images.clear();
  frame.depth.reset();
  frame.mask.reset();
  frame.jpeg.clear();
}

}  // namespace

LiveInput::LiveInput(Input& input,
                     std::function<bool()> should_stop,
                     std::function<bool()> is_paused)
    : input_(input),
      should_stop_(std::move(should_stop)),
      is_paused_(std::move(is_paused)),
      arrivals_(kMaxWaiting) {}

LiveInput::~LiveInput() {
  is_closed_ = true;
  arrivals_.close();
}

void LiveInput::read() {
  Arrival arrival;
  while (!is_closed_ && !should_stop_()) {
    std::optional<InputFrame> frame = input_.next();
    if (!frame) break;
    if (input_.info().is_live && is_paused_()) continue;
    arrival.push_back(std::make_unique<InputFrame>(*std::move(frame)));
    if (arrivals_.try_push(arrival)) {
      arrival.clear();
    } else {
      drop(*arrival.back());
    }
  }
  arrivals_.push(std::move(arrival));  // What was dropped just before the end.
  arrivals_.close();
}

std::optional<InputFrame> LiveInput::next() {
  if (!thread_.joinable()) thread_ = std::jthread([this] { read(); });
  while (ready_.empty()) {
    std::optional<Arrival> arrival = arrivals_.pop();
    if (!arrival) return std::nullopt;
    ready_ = *std::move(arrival);
  }
  const std::unique_ptr<InputFrame> frame = std::move(ready_.front());
  ready_.pop_front();
  return std::move(*frame);
}

}  // namespace waymark
