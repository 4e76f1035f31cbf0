// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/paced_input.h"

#include <algorithm>
#include <thread>

namespace waymark {

std::optional<InputFrame> PacedInput::next() {
  using namespace std::chrono_literals;
  constexpr Clock::duration kStep = 50ms;  // A wait may be long and the user may want to end it.
  std::optional<InputFrame> frame = input_.next();
  if (!frame) return frame;
  if (!start_) start_ = Start{Clock::now(), frame->timestamp_ns};
  const double elapsed_s = 1e-9 * static_cast<double>(frame->timestamp_ns - start_->timestamp_ns);
  const auto since_start = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(elapsed_s / speed_));
  for (auto now = Clock::now(); !should_stop_(); now = Clock::now()) {
    if (is_paused_()) {
      std::this_thread::sleep_for(kStep);
      start_->time += Clock::now() - now;
      continue;
    }
    const Clock::time_point due = start_->time + since_start;
    if (now >= due) break;
    std::this_thread::sleep_for(std::min(due - now, kStep));
  }
  return frame;
}

}  // namespace waymark
