// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <utility>

#include "waymark/input/input.h"

namespace waymark {

/// Another input at its own rate, as a camera would give it: each frame comes no earlier after the
/// first than its time stamp says. Does not wait once should_stop() says so; while is_paused() says
/// so, its clock stands still.
class PacedInput : public Input {
 public:
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

  struct Start {
    Clock::time_point time;
    std::int64_t timestamp_ns = 0;
  };

  Input& input_;
  const double speed_;
  const std::function<bool()> should_stop_;
  const std::function<bool()> is_paused_;
  std::optional<Start> start_;
};

}  // namespace waymark
