// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_record_writer.h"

namespace waymark {

// The records of each kind, as map files and journals have them; see docs/map-format.md.

inline constexpr int kMapVersion = 1;

/// The program and its version.
std::string_view map_producer();

/// The distinct rigs of keyframes, in the order in which files number them.
class RigTable {
 public:
  /// Takes in the rigs that are new among those of a map's keyframes. Throws InputError for a
  /// camera that was made without a description.
  void add(const Map& map);
  /// Number of rigs.
  std::size_t size() const { return rigs_.size(); }
  /// Place of a rig that was added.
  std::uint64_t index_of(const Rig& rig) const;
  /// Writes the cameras of the rigs from one on.
  void write_cameras(MapRecordWriter& writer, std::size_t first_rig) const;

 private:
  bool contains(const Rig& rig) const;

  std::vector<std::shared_ptr<const Rig>> rigs_;
};

/// Writes what all keyframes and landmarks hang on: ends of ids and settings. OutputError where
/// there are more of anything than readers take.
void write_map_record(MapRecordWriter& writer, const StoredMap& stored);
void write_submaps(MapRecordWriter& writer, const Map& map);
void write_keyframe(MapRecordWriter& writer,
                    KeyframeId id,
                    const Keyframe& keyframe,
                    const RigTable& rigs);
/// A keyframe that was written before, without what never changes.
void write_keyframe_state(MapRecordWriter& writer,
                          KeyframeId id,
                          const Keyframe& keyframe,
                          const RigTable& rigs);
void write_landmarks(MapRecordWriter& writer, const Map& map);
/// Some of the landmarks; ids ascend.
void write_landmarks(MapRecordWriter& writer, const Map& map, const std::vector<LandmarkId>& ids);
/// Landmarks that are gone; ids ascend.
void write_erased_landmarks(MapRecordWriter& writer, const std::vector<LandmarkId>& ids);
void write_erased_keyframe(MapRecordWriter& writer,
                           KeyframeId id,
                           const KeyframeForwarding& forwarding);
void write_merged_landmarks(MapRecordWriter& writer, const Map& map);
void write_loop_edges(MapRecordWriter& writer, const Map& map);
void write_markers(MapRecordWriter& writer, const Map& map);
/// The image of a keyframe.
void write_image(MapRecordWriter& writer, KeyframeId id, const SharedJpeg& jpeg);

}  // namespace waymark
