// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "waymark/map/map.h"

namespace waymark {

/// Saves the newest map of a running session every so often, in a thread of its own: neither
/// tracking nor mapping waits. Whenever the program is killed, the file holds the last map that was
/// saved as a whole.
class Autosave {
 public:
  /// Never saves if interval_s is 0. `settings` are those of the session, as YAML.
  Autosave(std::filesystem::path path, double interval_s, std::string settings);
  /// Waits for the save under way.
  ~Autosave() = default;

  /// To be called often: saves the map when it is time, unless it is empty or the last save is
  /// still under way. Gives what went wrong with an earlier one; the next one will be tried.
  std::optional<std::string> update(const std::shared_ptr<const Map>& map);
  /// Waits for the save under way and saves the map. Throws OutputError.
  void save(const std::shared_ptr<const Map>& map);

 private:
  using Clock = std::chrono::steady_clock;

  const std::filesystem::path path_;
  const Clock::duration interval_;
  const std::string settings_;
  Clock::time_point last_start_ = Clock::now();
  std::future<void> under_way_;
};

}  // namespace waymark
