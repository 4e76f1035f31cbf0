// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "waymark/base/mailbox.h"
#include "waymark/input/input.h"

namespace waymark {

/// Another input that comes when it comes, read in a thread of its own: frames for which there is
/// no room, since those before are still worked on, are dropped and have a fault that says so.
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
  using Arrival = std::deque<std::unique_ptr<InputFrame>>;

  void read();

  Input& input_;
  const std::function<bool()> should_stop_;
  const std::function<bool()> is_paused_;
  Mailbox<Arrival> arrivals_;
  Arrival ready_;
  std::atomic<bool> is_closed_{false};
  std::jthread thread_;
};

}  // namespace waymark
