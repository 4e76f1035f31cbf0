// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_journal.h"

#include "waymark/base/check.h"
#include "waymark/mapfile/map_imu.h"
#include "waymark/mapfile/map_odometry.h"
#include "waymark/mapfile/map_writer.h"

namespace waymark {
namespace {

/// Of the keyframes, from which on writing the map anew is as quick as what changed.
constexpr std::size_t kMostMeasuredPart = 4;

}  // namespace

void MapJournal::save(const StoredMap& stored) {
  WAYMARK_CHECK(stored.map != nullptr);
  if (const auto difference = plan_change(stored)) {
    append(stored, *difference);
  } else {
    save_whole(stored);
  }
}

void MapJournal::save_whole(const StoredMap& stored) {
  last_ = {};  // If this fails, the files are not what they were or will be.
  journal_.reset();
  rigs_ = {};
  rigs_.add(*stored.map);
  file_checksum_ = write_map_file(path_, stored, rigs_);
  file_bytes_ = std::filesystem::file_size(path_);
  last_ = stored;
}

std::optional<MapDifference> MapJournal::plan_change(const StoredMap& stored) const {
  if (!last_.map || file_bytes_ < small_bytes_) return std::nullopt;
  if (journal_ && journal_->size() > file_bytes_) return std::nullopt;
  auto difference = find_difference(*last_.map, *stored.map);
  const std::size_t num_keyframes = stored.map->keyframes().size();
  if (difference && kMostMeasuredPart * difference->measured.size() > num_keyframes) return {};
  return difference;
}

void MapJournal::append(const StoredMap& stored, const MapDifference& difference) {
  const StoredMap before = std::exchange(last_, {});  // Unless this succeeds, all is written anew.
  if (!journal_) begin_journal();
  const std::size_t num_known_rigs = rigs_.size();
  rigs_.add(*stored.map);
  MapRecordWriter writer([&](std::string_view bytes) { journal_->write(bytes); },
                         journal_of(path_).string());
  write_change(writer, stored, difference, num_known_rigs);
  for (const auto& [id, jpeg] : stored.images) {
    const bool is_new = !before.images.contains(id);
    if (is_new && stored.map->keyframes().contains(id)) write_image(writer, id, jpeg);
  }
  writer.write_counts();
  journal_->commit();
  last_ = stored;
}

void MapJournal::begin_journal() {
  journal_.emplace(journal_of(path_));
  MapRecordWriter writer([&](std::string_view bytes) { journal_->write(bytes); },
                         journal_of(path_).string());
  writer.write_journal_header(kMapVersion, map_producer(), file_checksum_);
}

void MapJournal::write_change(MapRecordWriter& writer,
                              const StoredMap& stored,
                              const MapDifference& difference,
                              std::size_t num_known_rigs) {
  const Map& map = *stored.map;
  write_map_record(writer, stored);
  rigs_.write_cameras(writer, num_known_rigs);
  write_submaps(writer, map);
  for (const KeyframeId id : difference.measured) {
    write_keyframe(writer, id, map.keyframes().at(id), rigs_);
  }
  for (const KeyframeId id : difference.changed) {
    write_keyframe_state(writer, id, map.keyframes().at(id), rigs_);
  }
  write_landmarks(writer, map, difference.landmarks);
  write_erased_landmarks(writer, difference.erased_landmarks);
  for (const KeyframeId id : difference.erased) {
    write_erased_keyframe(writer, id, map.keyframe_forwarding().at(id));
  }
  write_merged_landmarks(writer, map);
  write_loop_edges(writer, map);
  write_odometry(writer, map, difference.noted);
  write_markers(writer, map);
  write_imu(writer, stored.imu);
}

}  // namespace waymark
