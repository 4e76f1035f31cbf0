// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_writer.h"

#include <system_error>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_imu.h"
#include "waymark/mapfile/map_odometry.h"

namespace waymark {

std::filesystem::path journal_of(const std::filesystem::path& map_path) {
  std::filesystem::path path = map_path;
  path += ".journal";
  return path;
}

std::uint32_t write_map_file(const std::filesystem::path& path,
                             const StoredMap& stored,
                             const RigTable& rigs) {
  const Map& map = *stored.map;
  AtomicFile file(path);
  MapRecordWriter writer([&](std::string_view bytes) { file.write(bytes); }, path.string());
  writer.write_header(kMapVersion, map_producer());
  write_map_record(writer, stored);
  rigs.write_cameras(writer, 0);
  write_submaps(writer, map);
  map.keyframes().for_each(
      [&](KeyframeId id, const Keyframe& keyframe) { write_keyframe(writer, id, keyframe, rigs); });
  write_landmarks(writer, map);
  map.keyframe_forwarding().for_each([&](KeyframeId id, const KeyframeForwarding& forwarding) {
    write_erased_keyframe(writer, id, forwarding);
  });
  write_merged_landmarks(writer, map);
  write_loop_edges(writer, map);
  write_odometry(writer, map);
  write_markers(writer, map);
  write_imu(writer, stored.imu);
  for (const auto& [id, jpeg] : stored.images) {
    // Erased keyframes may still have one.
    if (map.keyframes().contains(id)) write_image(writer, id, jpeg);
  }
  writer.write_counts();
  file.commit();
  // One of the file before: if it stays, it is known by its checksum not to belong to this one.
  std::error_code ignored;
  std::filesystem::remove(journal_of(path), ignored);
  return writer.checksum();
}

void save_map(const std::filesystem::path& path, const StoredMap& stored) {
  WAYMARK_CHECK(stored.map != nullptr);
  RigTable rigs;
  rigs.add(*stored.map);
  write_map_file(path, stored, rigs);
}

}  // namespace waymark
