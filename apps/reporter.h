// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

namespace waymark {

enum class Verbosity { kQuiet, kNormal, kVerbose };

/// Tells the user on standard error what is going on: lines, and the progress of a long run as a
/// bar on a terminal or else as a line every few seconds. Everything also goes to the log, if any.
/// What cannot be written is no reason to stop: check_log() tells in the end.
class Reporter {
 public:
  /// Makes the folder of the log, too. Throws OutputError when the log cannot be made.
  Reporter(Verbosity verbosity, const std::filesystem::path& log);
  ~Reporter();

  /// Something to know, kept from standard error by kQuiet.
  void info(std::string_view line);
  /// Something to know when looking closely: standard error at kVerbose only.
  void detail(std::string_view line);
  /// Something that may be wrong; always shown.
  void warning(std::string_view line);
  /// What ends the program, for the log; main() tells the user.
  void failure(std::string_view line);

  /// num_done of num_total (if it is known) frames are done; state names the tracker's. Begins anew
  /// where fewer are done than before.
  void progress(std::size_t num_done, std::optional<std::size_t> num_total, std::string_view state);
  /// Removes the bar.
  void finish_progress();

  /// Throws OutputError when a message could not be written to the log.
  void check_log() const;

 private:
  using Clock = std::chrono::steady_clock;

  void write(std::string_view text, bool to_terminal);

  Verbosity verbosity_;
  bool is_terminal_;
  bool is_bar_shown_ = false;
  const std::filesystem::path log_path_;
  std::ofstream log_;
  std::optional<Clock::time_point> start_;
  Clock::time_point last_shown_;
  std::size_t last_done_ = 0;
};

/// Seconds as "12 s", "3:05 min" or "2:03 h".
std::string format_duration(double seconds);

}  // namespace waymark
