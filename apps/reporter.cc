// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "reporter.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using namespace std::chrono_literals;

constexpr auto kBarInterval = 100ms;
constexpr auto kLineInterval = 5s;
constexpr std::size_t kBarWidth = 24;

std::string bar(double done) {
  const auto filled = static_cast<std::size_t>(std::clamp(done, 0.0, 1.0) * kBarWidth);
  return fmt::format("[{}{}]", std::string(filled, '#'), std::string(kBarWidth - filled, ' '));
}

}  // namespace

std::string format_duration(double seconds) {
  const auto total = static_cast<long>(std::max(0.0, seconds) + 0.5);
  if (total < 60) return fmt::format("{} s", total);
  if (total < 3600) return fmt::format("{}:{:02} min", total / 60, total % 60);
  return fmt::format("{}:{:02} h", total / 3600, total % 3600 / 60);
}

Reporter::Reporter(Verbosity verbosity, const std::filesystem::path& log)
    : verbosity_(verbosity), is_terminal_(isatty(STDERR_FILENO) != 0), log_path_(log) {
  if (log.empty()) return;
  if (log.has_parent_path()) make_output_folder(log.parent_path());
  log_.open(log);
  if (!log_) throw OutputError(log.string(), "cannot be written, expected a file name for --log");
}

Reporter::~Reporter() { finish_progress(); }

void Reporter::info(std::string_view line) { write(line, verbosity_ != Verbosity::kQuiet); }

void Reporter::detail(std::string_view line) { write(line, verbosity_ == Verbosity::kVerbose); }

void Reporter::warning(std::string_view line) { write(fmt::format("warning: {}", line), true); }

void Reporter::failure(std::string_view line) { write(fmt::format("error: {}", line), false); }

void Reporter::progress(std::size_t num_done,
                        std::optional<std::size_t> num_total,
                        std::string_view state) {
  if (verbosity_ == Verbosity::kQuiet) return;
  const Clock::time_point now = Clock::now();
  const bool is_again = num_done < std::exchange(last_done_, num_done);
  if (!start_ || is_again) {
    start_ = now;
    last_shown_ = now;
    return;
  }
  if (now - last_shown_ < (is_terminal_ ? Clock::duration(kBarInterval) : kLineInterval)) return;
  last_shown_ = now;

  const double elapsed_s = std::chrono::duration<double>(now - *start_).count();
  const double frames_per_s = static_cast<double>(num_done) / std::max(elapsed_s, 1e-9);
  std::string text = fmt::format("frame {}", num_done);
  if (num_total) {
    const auto total = static_cast<double>(*num_total);
    const double left_s = (total - static_cast<double>(num_done)) / std::max(frames_per_s, 1e-9);
    const double done = static_cast<double>(num_done) / std::max(total, 1.0);
    text = fmt::format("{} frame {} of {}, {} left",
                       is_terminal_ ? bar(done) : fmt::format("{:.0f} %", 100.0 * done),
                       num_done,
                       *num_total,
                       format_duration(left_s));
  }
  text += fmt::format(", {:.1f} frames/s, {}", frames_per_s, state);
  if (is_terminal_) {
    write_text(message_stream(), "\r\x1b[K" + printable(text));
    std::fflush(message_stream());
    is_bar_shown_ = true;
  } else {
    write(text, true);
  }
}

void Reporter::finish_progress() {
  if (!is_bar_shown_) return;
  write_text(message_stream(), "\r\x1b[K");
  std::fflush(message_stream());
  is_bar_shown_ = false;
}

void Reporter::check_log() const {
  if (!log_.is_open() || log_) return;
  throw OutputError(log_path_.string(), "messages got lost, expected enough space for --log");
}

void Reporter::write(std::string_view text, bool to_terminal) {
  const std::string line = printable(text);
  if (log_.is_open()) log_ << line << '\n' << std::flush;
  if (!to_terminal) return;
  finish_progress();
  write_text(message_stream(), line + "\n");
}

}  // namespace waymark
