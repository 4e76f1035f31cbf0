// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <exception>
#include <optional>
#include <thread>

#include "waymark/base/mailbox.h"
#include "waymark/base/prefetch.h"
#include "waymark/input/input.h"

namespace waymark {

/// Another input, read in a thread of its own and decoded by several, a few frames ahead. The same
/// frames in the same order; what the other input throws comes out of next(), after the frames
/// before. Of inputs for which can_decode_apart() is true.
class InputPrefetch : public Input {
 public:
  /// The input is borrowed. num_threads: that decode, at least one; they start with the first
  /// frame.
  explicit InputPrefetch(Input& input, unsigned num_threads = std::thread::hardware_concurrency());
  ~InputPrefetch() override;
  InputPrefetch(const InputPrefetch&) = delete;
  InputPrefetch& operator=(const InputPrefetch&) = delete;

  const InputInfo& info() const override { return input_.info(); }
  std::optional<InputFrame> next() override;

 private:
  void read();
  std::optional<Decoding> next_decoding_of_input();

  Input& input_;
  const unsigned num_threads_;
  Mailbox<InputFrame> frames_;
  std::exception_ptr failure_;  // Of the reader; set before the mailbox is closed.
  std::atomic<bool> is_closed_{false};
  std::jthread thread_;
};

}  // namespace waymark
