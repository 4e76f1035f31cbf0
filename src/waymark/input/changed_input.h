// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "waymark/input/input.h"

namespace waymark {

/// Another input whose images come out changed.
class ChangedInput : public Input {
 public:
  const InputInfo& info() const override { return info_; }

  std::optional<InputFrame> next() override {
    std::optional<InputFrame> frame = input_->next();
    info_.counts = input_->info().counts;
    if (frame) change(*frame);
    return frame;
  }

  CameraChain of_unchanged_images(CameraChain chain) const override {
    return input_->of_unchanged_images(std::move(chain));
  }

  bool can_decode_apart() const override { return input_->can_decode_apart(); }

  std::optional<Decoding> next_decoding() override {
    std::optional<Decoding> decoding = input_->next_decoding();
    if (!decoding) return decoding;
    return [this, decode = *std::move(decoding)] {
      InputFrame frame = decode();
      if (frame.fault == FrameFault::kNone) change(frame);
      return frame;
    };
  }

  void complete(InputFrame& frame) override {
    const bool is_changed = frame.fault == FrameFault::kNone;
    input_->complete(frame);
    info_.counts = input_->info().counts;
    if (!is_changed) change(frame);
  }

 protected:
  explicit ChangedInput(std::unique_ptr<Input> input)
      : input_(std::move(input)), info_(input_->info()) {}

  /// What the other input says.
  const InputInfo& unchanged_info() const { return input_->info(); }

 private:
  /// Changes all images that a frame has. Called from any thread.
  virtual void change(InputFrame& frame) const = 0;

  std::unique_ptr<Input> input_;

 protected:
  InputInfo info_;  ///< What the other input says, to be changed by the constructor.
};

}  // namespace waymark
