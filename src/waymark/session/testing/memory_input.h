// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/input/input.h"

namespace waymark::testing {

/// Gives frames from memory, and throws an InputError in place of one of them, if that is wanted.
class MemoryInput : public Input {
 public:
  explicit MemoryInput(std::vector<InputFrame> frames,
                       std::optional<std::size_t> throws_at = std::nullopt)
      : frames_(std::move(frames)), throws_at_(throws_at) {
    info_.format = "memory";
    info_.num_frames = frames_.size();
  }

  const InputInfo& info() const override { return info_; }
  InputInfo& info() { return info_; }

  std::optional<InputFrame> next() override {
    if (on_next) on_next(next_);
    if (next_ == throws_at_) throw InputError("memory", "is torn out, expected it to stay");
    if (next_ == frames_.size()) return std::nullopt;
    return frames_[next_++];
  }

  std::function<void(std::size_t index)> on_next;  ///< Called before each frame is given.

 private:
  std::vector<InputFrame> frames_;
  std::optional<std::size_t> throws_at_;
  InputInfo info_;
  std::size_t next_ = 0;
};

/// Frames of one black pixel, 0.1 s apart, each with a made-up JPEG file that names its time.
inline std::vector<InputFrame> small_frames(std::size_t count, std::int64_t first_ns = 0) {
  std::vector<InputFrame> frames(count);
  for (std::size_t i = 0; i < count; ++i) {
    frames[i].index = i;
    frames[i].timestamp_ns = first_ns + 100'000'000 * static_cast<std::int64_t>(i);
    frames[i].images.emplace_back(1, 1);
    frames[i].jpeg = std::to_string(frames[i].timestamp_ns);
  }
  return frames;
}

/// All frames that an input still has.
inline std::vector<InputFrame> read_all(Input& input) {
  std::vector<InputFrame> frames;
  while (std::optional<InputFrame> frame = input.next()) frames.push_back(*std::move(frame));
  return frames;
}

}  // namespace waymark::testing
