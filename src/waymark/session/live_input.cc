// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/live_input.h"

#include <algorithm>
#include <iterator>
#include <thread>
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
  frame.warning.clear();
}

}  // namespace

std::optional<InputFrame> PacedInput::next() {
  using namespace std::chrono_literals;
  constexpr Clock::duration kStep = 50ms;  // A wait may be long and the user may want to end it.
  std::optional<InputFrame> frame = input_.next();
  if (!frame) return frame;
  if (!due_) due_ = Due{Clock::now(), frame->timestamp_ns};
  const double gap_s = 1e-9 * static_cast<double>(frame->timestamp_ns - due_->timestamp_ns);
  due_->time += std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(std::min(gap_s, kMaxGapS) / speed_));
  due_->timestamp_ns = frame->timestamp_ns;
  for (auto now = Clock::now(); !should_stop_(); now = Clock::now()) {
    if (is_paused_()) {
      std::this_thread::sleep_for(kStep);
      due_->time += Clock::now() - now;
      continue;
    }
    if (now >= due_->time) break;
    std::this_thread::sleep_for(std::min(due_->time - now, kStep));
  }
  return frame;
}

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
  try {
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
  } catch (...) {
    failure_ = std::current_exception();
  }
  arrivals_.push(std::move(arrival));  // What was dropped just before the end.
  arrivals_.close();
}

std::optional<InputFrame> LiveInput::next() {
  if (!thread_.joinable()) thread_ = std::jthread([this] { read(); });
  while (ready_.empty()) {
    std::optional<Arrival> arrival = arrivals_.pop();
    if (!arrival && failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    if (!arrival) return std::nullopt;
    std::move(arrival->begin(), arrival->end(), std::back_inserter(ready_));
  }
  const std::unique_ptr<InputFrame> frame = std::move(ready_.front());
  ready_.pop_front();
  return std::move(*frame);
}

TimedInput::TimedInput(Input& input,
                       double pace,
                       bool may_drop,
                       const std::function<bool()>& should_stop,
                       const std::function<bool()>& is_paused)
    : input_(&input) {
  if (pace > 0.0) input_ = &paced_.emplace(*input_, pace, should_stop, is_paused);
  if (may_drop && (pace > 0.0 || input.info().is_live)) {
    input_ = &arriving_.emplace(*input_, should_stop, is_paused);
  }
}

}  // namespace waymark
