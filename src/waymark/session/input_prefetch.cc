// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/input_prefetch.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace waymark {

InputPrefetch::InputPrefetch(Input& input, unsigned num_threads)
    : input_(input), num_threads_(std::max(num_threads, 1u)), frames_(num_threads_) {}

InputPrefetch::~InputPrefetch() {
  is_closed_ = true;
  frames_.close();
}

/// Nothing at the end, or where the input fails.
std::optional<Input::Decoding> InputPrefetch::next_decoding_of_input() {
  try {
    return input_.next_decoding();
  } catch (...) {
    failure_ = std::current_exception();
    return std::nullopt;
  }
}

void InputPrefetch::read() {
  // Two per thread: a frame that takes longer than its neighbours stops nobody.
  const std::size_t capacity = 2 * std::size_t{num_threads_};
  try {
    Prefetch<InputFrame> work(num_threads_, capacity);
    bool has_ended = false;
    while (!is_closed_) {
      while (!has_ended && work.size() < capacity) {
        std::optional<Decoding> decoding = next_decoding_of_input();
        has_ended = !decoding;
        if (decoding) work.give([decode = *std::move(decoding)](unsigned) { return decode(); });
      }
      if (work.size() == 0) break;
      frames_.push(work.take());
    }
  } catch (...) {
    failure_ = std::current_exception();
  }
  frames_.close();
}

std::optional<InputFrame> InputPrefetch::next() {
  if (!thread_.joinable()) thread_ = std::jthread([this] { read(); });
  std::optional<InputFrame> frame = frames_.pop();
  if (frame) {
    input_.complete(*frame);
  } else if (failure_) {
    std::rethrow_exception(std::exchange(failure_, nullptr));
  }
  return frame;
}

}  // namespace waymark
