// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_journal.h"
#include "waymark/session/keyframe_image_cache.h"

namespace waymark {

/// Saves the newest map of a running session every so often, in a thread of its own: neither
/// tracking nor mapping waits. Of a large map only what changed is written, to a journal beside the
/// file, up to the end of the session. Whenever the program is killed, the file and its journal
/// hold the last map that was saved as a whole.
class Autosave {
 public:
  /// update() never saves if interval_s is 0. `settings` are those of the session, as YAML; the
  /// images, which are saved with the map, are borrowed.
  Autosave(std::filesystem::path path,
           double interval_s,
           std::string settings,
           const KeyframeImageCache& images);
  /// Waits for the save under way.
  ~Autosave() = default;

  /// To be called often: saves the map when it is time, unless it is empty or the last save is
  /// still under way. Gives what went wrong with an earlier one; the next one will be tried. imu:
  /// what is known of it, which the map keeps where it is used.
  std::optional<std::string> update(const std::shared_ptr<const Map>& map,
                                    const std::optional<InertialReport>& imu = std::nullopt);
  /// The next update() saves the map as soon as it can, the file by itself; on_done hears, from a
  /// later update() or the last save(), what went wrong, or nothing.
  void save_soon(std::function<void(const std::string& error)> on_done);
  const std::filesystem::path& path() const { return path_; }
  /// Waits for the save under way and saves the map, the file by itself. Throws OutputError.
  void save(const std::shared_ptr<const Map>& map,
            const std::optional<InertialReport>& imu = std::nullopt);

 private:
  using Clock = std::chrono::steady_clock;

  StoredMap prepare(const std::shared_ptr<const Map>& map,
                    const std::optional<InertialReport>& imu) const;
  /// Takes what became of the save under way; what went wrong, or an empty text.
  std::string finish_save();

  const std::filesystem::path path_;
  const Clock::duration interval_;
  const std::string settings_;
  const KeyframeImageCache& images_;
  Clock::time_point last_start_ = Clock::now();
  MapJournal journal_;  // Of the save under way as long as there is one.
  std::future<void> under_way_;
  using Waiting = std::vector<std::function<void(const std::string& error)>>;
  Waiting wanted_;  ///< For the next save.
  Waiting served_;  ///< By the one under way.
};

}  // namespace waymark
