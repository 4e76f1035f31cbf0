// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "waymark/base/mailbox.h"
#include "waymark/input/input.h"

namespace waymark {

/// Another input at its own rate, as a camera would give it: each frame comes no earlier after the
/// first than its time stamp says, but for gaps between time stamps: more than kMaxGapS of them
/// counts as that. Does not wait once should_stop() says so; while is_paused() says so, its clock
/// stands still.
class PacedInput : public Input {
 public:
  /// In seconds: a wrong time stamp must not hold up everything.
  static constexpr double kMaxGapS = 10.0;

  /// speed: times the input's own rate.
  PacedInput(Input& input,
             double speed,
             std::function<bool()> should_stop,
             std::function<bool()> is_paused)
      : input_(input),
        speed_(speed),
        should_stop_(std::move(should_stop)),
        is_paused_(std::move(is_paused)) {}

  const InputInfo& info() const override { return input_.info(); }
  std::optional<InputFrame> next() override;

 private:
  using Clock = std::chrono::steady_clock;

  /// When a frame is due.
  struct Due {
    Clock::time_point time;
    std::int64_t timestamp_ns = 0;
  };

  Input& input_;
  const double speed_;
  const std::function<bool()> should_stop_;
  const std::function<bool()> is_paused_;
  std::optional<Due> due_;  // Of the last frame.
};

/// Another input that comes when it comes, read in a thread of its own: frames for which there is
/// no room, since those before are still worked on, are dropped and have a fault that says so. What
/// the other input throws comes out of next(), after the frames before.
class LiveInput : public Input {
 public:
  /// should_stop: whether to read no more; for any thread.
  /// is_paused: whether frames of a camera are left out; likewise.
  LiveInput(Input& input, std::function<bool()> should_stop, std::function<bool()> is_paused);
  ~LiveInput() override;
  LiveInput(const LiveInput&) = delete;
  LiveInput& operator=(const LiveInput&) = delete;

  const InputInfo& info() const override { return input_.info(); }
  std::optional<InputFrame> next() override;

 private:
  /// A frame, after those dropped before it.
  using Arrival = std::vector<std::unique_ptr<InputFrame>>;

  void read();

  Input& input_;
  const std::function<bool()> should_stop_;
  const std::function<bool()> is_paused_;
  Mailbox<Arrival> arrivals_;
  std::deque<std::unique_ptr<InputFrame>> ready_;
  std::exception_ptr failure_;  // Of the reader; set before the mailbox is closed.
  std::atomic<bool> is_closed_{false};
  std::jthread thread_;
};

/// An input at its own pace, if it is a camera or is given one.
class TimedInput {
 public:
  /// pace: times the input's own rate; 0: as fast as it is asked for. may_drop: whether frames that
  /// come too early are dropped.
  TimedInput(Input& input,
             double pace,
             bool may_drop,
             const std::function<bool()>& should_stop,
             const std::function<bool()>& is_paused);

  Input& get() { return *input_; }

 private:
  Input* input_;
  std::optional<PacedInput> paced_;
  std::optional<LiveInput> arriving_;
};

}  // namespace waymark
