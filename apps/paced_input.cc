// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "paced_input.h"

#include <algorithm>
#include <thread>

namespace waymark {

std::optional<InputFrame> PacedInput::next() {
  using namespace std::chrono_literals;
  std::optional<InputFrame> frame = input_.next();
  if (!frame) return frame;
  if (!start_) start_ = Start{Clock::now(), frame->timestamp_ns};
  const double elapsed_s = 1e-9 * static_cast<double>(frame->timestamp_ns - start_->timestamp_ns);
  const Clock::time_point due =
      start_->time + std::chrono::duration_cast<Clock::duration>(
                         std::chrono::duration<double>(elapsed_s / speed_));
  // In short steps, since a wait may be long and the user may want to end it.
  for (auto now = Clock::now(); now < due && !should_stop_(); now = Clock::now()) {
    std::this_thread::sleep_for(std::min<Clock::duration>(due - now, 50ms));
  }
  return frame;
}

}  // namespace waymark
