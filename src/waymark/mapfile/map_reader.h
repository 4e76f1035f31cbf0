// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_record.h"

namespace waymark {

/// Reads the features of a keyframe that the rig made. Throws InputError for what cannot be.
std::shared_ptr<const Features> read_features(MapRecord& record, std::shared_ptr<const Rig> rig);

/// Reads the markers that a keyframe of a rig sees; null where it has none. Throws InputError for
/// what cannot be.
std::shared_ptr<const MarkerObservations> read_markers(MapRecord& record, const Rig& rig);

/// Gathers a map from the records of version 1, which come in the order of kinds that
/// docs/map-format.md gives, and the changes of its journal. What one record says is checked here;
/// how they fit together is left to Map::list_broken_invariants().
class MapReader {
 public:
  MapReader(std::string name, const CameraRegistry& registry)
      : name_(std::move(name)), registry_(registry) {}

  /// Takes the next record in, whose kind is not "end".
  void add(MapRecord& record, const std::string& kind);
  /// Takes in the record of the kind "end", after which changes of a journal may follow.
  void end(MapRecord& record);
  /// Gives all that was gathered. InputError for what no map can be made of.
  StoredMap finish();

 private:
  struct Kind;
  static const std::vector<Kind>& kinds();

  void check_order(const MapRecord& record, std::size_t kind, std::uint64_t id);
  void begin_change();
  void check_ids() const;

  void read_map(MapRecord& record);
  void read_camera(MapRecord& record);
  void read_submap(MapRecord& record);
  void read_keyframe(MapRecord& record);
  void read_keyframe_state(MapRecord& record);
  std::shared_ptr<const Rig> read_rig(MapRecord& record) const;
  void read_state(MapRecord& record, Keyframe& keyframe);
  void read_landmarks(MapRecord& record);
  void read_erased_landmarks(MapRecord& record);
  void read_erased_keyframe(MapRecord& record);
  void read_merged_landmarks(MapRecord& record);
  void read_loop_edge(MapRecord& record);
  void read_odometry(MapRecord& record);
  void read_marker(MapRecord& record);
  void read_imu(MapRecord& record);
  void read_image(MapRecord& record);
  std::vector<LandmarkId> read_landmark_ids(MapRecord& record, LandmarkId& last) const;
  template <class Stored>
  void put(const MapRecord& record, std::vector<Stored>& rows, Stored row) const;
  void drop_erased();

  const std::string name_;
  const CameraRegistry& registry_;
  std::size_t kind_ = 0;  // Of the last record, by place in kinds().
  std::uint64_t id_ = 0;
  std::map<std::string, std::uint64_t> counts_;           // Of records by kind, since the last end.
  LandmarkId last_landmark_, last_erased_, last_merged_;  // Since then, of their records.
  KeyframeId last_noted_;                                 // The same.
  std::uint64_t num_cameras_ = 0;
  std::size_t num_rigs_before_ = 0;  // Up to the last end.
  std::vector<std::shared_ptr<Rig>> rigs_;
  MapParts parts_;
  // By changes; they go at the end.
  bool has_changes_ = false;
  std::vector<KeyframeId> erased_keyframes_;
  std::vector<LandmarkId> erased_landmarks_;
  StoredMap stored_;
};

}  // namespace waymark
