// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "waymark/base/append_file.h"
#include "waymark/mapfile/map_difference.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_sections.h"

namespace waymark {

/// Keeps the file of a map up to date while the map grows. Of a large map only what changed since
/// is appended to a journal beside the file, which load_map() takes in; the file is written anew
/// whenever the journal has grown as large as it. Whenever the program is killed, both together are
/// a map that was saved as a whole.
///
/// Between two saves it holds what it saved last: as much memory as the pages that changed since.
class MapJournal {
 public:
  /// Files smaller than that are always written as a whole: it costs little, and a file by itself
  /// is easier to handle.
  static constexpr std::uint64_t kSmallBytes = std::uint64_t{64} << 20;

  explicit MapJournal(std::filesystem::path path, std::uint64_t small_bytes = kSmallBytes)
      : path_(std::move(path)), small_bytes_(small_bytes) {}

  /// As save_map(), but the file may have a journal afterwards.
  void save(const StoredMap& stored);
  /// As save_map(): the file by itself is the map.
  void save_whole(const StoredMap& stored);

 private:
  /// What to append; nothing where the file is rather to be written anew.
  std::optional<MapDifference> plan_change(const StoredMap& stored) const;
  void append(const StoredMap& stored, const MapDifference& difference);
  void begin_journal();
  void write_change(MapRecordWriter& writer,
                    const StoredMap& stored,
                    const MapDifference& difference,
                    std::size_t num_known_rigs);

  const std::filesystem::path path_;
  const std::uint64_t small_bytes_;
  StoredMap last_;  // What the files hold; without a map if that is not known.
  RigTable rigs_;   // In the order of the files.
  std::uint32_t file_checksum_ = 0;
  std::uint64_t file_bytes_ = 0;
  std::optional<AppendFile> journal_;
};

}  // namespace waymark
