// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "waymark/base/check.h"
#include "waymark/camera/rig.h"
#include "waymark/image/image_header.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/map_record_writer.h"

namespace waymark {
namespace {

constexpr int kVersion = 1;
constexpr std::string_view kProducer = "waymark " WAYMARK_VERSION;

/// The distinct rigs of a map, in the order of the keyframes.
class RigTable {
 public:
  explicit RigTable(const Map& map) {
    map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) { add(*keyframe.rig); });
  }

  const std::vector<const Rig*>& rigs() const { return rigs_; }

  std::uint64_t index_of(const Rig& rig) const {
    const auto at = std::find_if(
        rigs_.begin(), rigs_.end(), [&](const Rig* known) { return is_same_rig(*known, rig); });
    WAYMARK_CHECK(at != rigs_.end());
    return static_cast<std::uint64_t>(at - rigs_.begin());
  }

 private:
  void add(const Rig& rig) {
    if (!rigs_.empty() && rigs_.back() == &rig) return;
    for (const RigCamera& camera : rig.cameras) {
      if (camera.description) continue;
      throw InputError("map",
                       fmt::format("holds a camera of the model {} that was made without a "
                                   "description, expected rigs made by make_rig()",
                                   camera.camera ? camera.camera->model() : "none"));
    }
    const bool is_known = std::any_of(
        rigs_.begin(), rigs_.end(), [&](const Rig* known) { return is_same_rig(*known, rig); });
    if (!is_known) rigs_.push_back(&rig);
  }

  std::vector<const Rig*> rigs_;
};

void write_cameras(MapRecordWriter& writer, const RigTable& table) {
  std::uint64_t id = 0;
  for (std::size_t rig = 0; rig < table.rigs().size(); ++rig) {
    for (const RigCamera& camera : table.rigs()[rig]->cameras) {
      const CameraDescription& description = *camera.description;
      writer.begin("camera", id++);
      writer.add("rig", rig);
      writer.add_text("camera_model", description.camera_model);
      writer.add_numbers("intrinsics", description.intrinsics);
      writer.add_text("distortion_model", description.distortion_model);
      writer.add_numbers("distortion_coeffs", description.distortion_coeffs);
      writer.add("width_px", static_cast<std::uint64_t>(description.width_px));
      writer.add("height_px", static_cast<std::uint64_t>(description.height_px));
      writer.add_transform("cam_from_rig", camera.cam_from_rig);
      writer.end();
    }
  }
}

void write_submaps(MapRecordWriter& writer, const Map& map) {
  std::uint64_t id = 0;
  for (const Submap& submap : map.submaps()) {
    writer.begin("submap", id++);
    writer.add_flag("is_metric", submap.is_metric);
    writer.add_id("root", submap.root);
    writer.add_id("joined_into", submap.joined_into);
    writer.end();
  }
}

/// A member of every keypoint.
template <class T>
std::vector<T> column(const std::vector<Keypoint>& keypoints, T Keypoint::*member) {
  std::vector<T> values;
  for (const Keypoint& keypoint : keypoints) values.push_back(keypoint.*member);
  return values;
}

void add_features(MapRecordWriter& writer, const Features& features) {
  const std::size_t count = features.size();
  WAYMARK_CHECK(features.bearings.size() == count && features.partner.size() == count &&
                features.level_pixel_from_bearing.size() == count &&
                features.size_rad.size() == count);
  WAYMARK_CHECK(features.num_primary <= count &&
                features.descriptors.size() == features.num_primary &&
                features.range_m.size() == features.num_primary &&
                features.inverse_range_sigma.size() == features.num_primary);
  const std::vector<Keypoint>& keypoints = features.keypoints;
  std::vector<Eigen::Vector2f> pixels;
  for (const Keypoint& keypoint : keypoints) pixels.emplace_back(keypoint.x_px, keypoint.y_px);
  writer.add_array("pixel", pixels);
  writer.add_array("angle_rad", column(keypoints, &Keypoint::angle_rad), kAngleRange);
  writer.add_array("response", column(keypoints, &Keypoint::response));
  writer.add_array("level", column(keypoints, &Keypoint::level));
  writer.add_array("camera", column(keypoints, &Keypoint::camera));
  if (features.num_edges > 0) writer.add("num_edges", features.num_edges);
  writer.add_array("descriptor", features.descriptors);
  writer.add_array("bearing", features.bearings);
  writer.add_array("level_pixel_from_bearing", features.level_pixel_from_bearing, kSlopeRange);
  writer.add_array("size_rad", features.size_rad, kFeatureSizeRange);
  writer.add_array("partner", features.partner);
  writer.add_array("range_m", features.range_m, kLengthRange);
  writer.add_array("inverse_range_sigma", features.inverse_range_sigma, kNotNegative);
}

void add_markers(MapRecordWriter& writer, const MarkerSightings& sightings) {
  std::vector<std::uint32_t> numbers;
  std::vector<std::uint8_t> cameras;
  std::vector<Eigen::Vector2f> pixels;
  std::vector<Eigen::Vector3f> bearings;
  std::vector<Matrix23f> slopes;
  for (const MarkerSighting& sighting : sightings) {
    numbers.push_back(static_cast<std::uint32_t>(sighting.id));
    cameras.push_back(sighting.camera);
    pixels.insert(pixels.end(), sighting.pixels.begin(), sighting.pixels.end());
    bearings.insert(bearings.end(), sighting.bearings.begin(), sighting.bearings.end());
    const auto& of_corners = sighting.pixel_from_bearing;
    slopes.insert(slopes.end(), of_corners.begin(), of_corners.end());
  }
  writer.add_array("marker", numbers);
  writer.add_array("marker_camera", cameras);
  writer.add_array("marker_pixel", pixels);
  writer.add_array("marker_bearing", bearings);
  writer.add_array("marker_pixel_from_bearing", slopes, kSlopeRange);
}

void write_keyframes(MapRecordWriter& writer, const Map& map, const RigTable& rigs) {
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    writer.begin("keyframe", id.value);
    writer.add("frame", keyframe.frame.value);
    writer.add_signed("timestamp_ns", keyframe.timestamp_ns);
    writer.add("rig", rigs.index_of(*keyframe.rig));
    writer.add_id("submap", keyframe.submap);
    writer.add_id("parent", keyframe.parent);
    writer.add_transform("rig_from_world", keyframe.rig_from_world);
    writer.add_number("applied_scale", keyframe.applied_scale, kScaleRange);
    add_features(writer, *keyframe.features);
    writer.add_array("landmark", keyframe.landmarks);
    if (keyframe.markers) add_markers(writer, *keyframe.markers);
    writer.end();
  });
}

/// Rows gathered until there are enough for a record.
struct LandmarkRows {
  std::vector<LandmarkId> id;
  std::vector<SubmapId> submap;
  std::vector<Eigen::Vector3d> position_in_world;
  std::vector<KeyframeId> reference;
  std::vector<std::uint32_t> num_visible;
  std::vector<std::uint32_t> num_found;
  std::vector<Descriptor> descriptor;
  std::vector<Eigen::Vector3d> direction;
  std::vector<double> size_m;
  std::vector<Eigen::Vector3d> across;
  bool has_edges = false;

  void add(LandmarkId landmark_id, const Landmark& landmark) {
    id.push_back(landmark_id);
    submap.push_back(landmark.submap);
    position_in_world.push_back(landmark.position_in_world);
    reference.push_back(landmark.reference);
    num_visible.push_back(landmark.num_visible);
    num_found.push_back(landmark.num_found);
    descriptor.push_back(landmark.appearance.descriptor);
    direction.push_back(landmark.appearance.direction);
    size_m.push_back(landmark.appearance.size_m);
    across.push_back(landmark.appearance.across);
    has_edges |= !across.back().isZero();
  }

  void write(MapRecordWriter& writer, std::uint64_t record_id) const {
    writer.begin("landmarks", record_id);
    writer.add_array("landmark", id);
    writer.add_array("submap", submap);
    writer.add_array("position_in_world", position_in_world, kLengthRange);
    writer.add_array("reference", reference);
    writer.add_array("num_visible", num_visible);
    writer.add_array("num_found", num_found);
    writer.add_array("descriptor", descriptor);
    writer.add_array("direction", direction, kDirectionRange);
    writer.add_array("size_m", size_m, kLandmarkSizeRange);
    if (has_edges) writer.add_array("across", across, kDirectionRange);
    writer.end();
  }
};

void write_landmarks(MapRecordWriter& writer, const Map& map) {
  LandmarkRows rows;
  std::uint64_t record_id = 0;
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    rows.add(id, landmark);
    if (rows.id.size() < kLandmarksPerRecord) return;
    rows.write(writer, record_id++);
    rows = {};
  });
  if (!rows.id.empty()) rows.write(writer, record_id);
}

void write_erased_keyframes(MapRecordWriter& writer, const Map& map) {
  map.keyframe_forwarding().for_each([&](KeyframeId id, const KeyframeForwarding& forwarding) {
    writer.begin("erased_keyframe", id.value);
    writer.add_id("heir", forwarding.heir);
    writer.add_transform("rig_from_heir", forwarding.rig_from_heir);
    writer.add_number("heir_scale", forwarding.heir_scale, kScaleRange);
    writer.add_number("scale", forwarding.scale, kScaleRange);
    writer.end();
  });
}

void write_merged_landmarks(MapRecordWriter& writer, const Map& map) {
  std::vector<LandmarkId> landmarks, survivors;
  std::uint64_t record_id = 0;
  const auto write = [&] {
    writer.begin("merged_landmarks", record_id++);
    writer.add_array("landmark", landmarks);
    writer.add_array("survivor", survivors);
    writer.end();
    landmarks.clear();
    survivors.clear();
  };
  map.landmark_forwarding().for_each([&](LandmarkId id, const LandmarkForwarding& forwarding) {
    landmarks.push_back(id);
    survivors.push_back(forwarding.survivor);
    if (landmarks.size() == kLandmarksPerRecord) write();
  });
  if (!landmarks.empty()) write();
}

void write_loop_edges(MapRecordWriter& writer, const Map& map) {
  std::uint64_t id = 0;
  for (const LoopEdge& edge : map.measured_loop_edges()) {
    writer.begin("loop_edge", id++);
    writer.add_id("from", edge.from);
    writer.add_id("to", edge.to);
    writer.add_transform("to_from_from",
                         {edge.to_from_from.rotation, edge.to_from_from.translation});
    writer.add_number("scale", edge.to_from_from.scale, kScaleRange);
    writer.end();
  }
}

void write_markers(MapRecordWriter& writer, const Map& map) {
  std::uint64_t id = 0;
  for (const MapMarker& marker : map.markers()) {
    writer.begin("marker", id++);
    writer.add("number", static_cast<std::uint64_t>(marker.id));
    writer.add_number("side_m", marker.side_m, kMarkerSideRange);
    writer.add_id("reference", marker.reference);
    writer.add_number("reference_scale", marker.reference_scale, kScaleRange);
    writer.add_transform("marker_from_reference", marker.marker_from_reference);
    if (const auto& surveyed = marker.surveyed_world_from_marker) {
      writer.add_transform("surveyed_world_from_marker", *surveyed);
    }
    writer.end();
  }
}

void write_images(MapRecordWriter& writer, const StoredMap& stored) {
  for (const auto& [id, jpeg] : stored.images) {
    if (!stored.map->keyframes().contains(id)) continue;  // Erased meanwhile.
    writer.begin("image", id.value);
    const std::optional<ImageSize> size = size_in_header(*jpeg);
    if (jpeg->size() > kMaxArrayBytes || (size && is_too_large(*size))) {
      writer.fail(fmt::format("jpeg would be too large, expected at most {} megapixels and {} MB",
                              kMaxMegapixels,
                              kMaxArrayBytes >> 20));
    }
    writer.add_bytes("jpeg", *jpeg);
    writer.end();
  }
}

/// What readers ask of a map as a whole.
void check_counts(const MapRecordWriter& writer, const StoredMap& stored) {
  const Map& map = *stored.map;
  const std::uint32_t end = map.landmarks().end_id().value;
  if (end > kMaxIds || map.keyframes().end_id().value > kMaxIds) {
    writer.fail(
        fmt::format("would have ids of landmarks up to {}, expected at most {}", end, kMaxIds));
  }
  if (map.submaps().size() > kMaxSubmaps || stored.settings.size() > kMaxTextBytes) {
    writer.fail(
        fmt::format("would have {} sub-maps and {} bytes of settings, expected at most {} "
                    "and {}",
                    map.submaps().size(),
                    stored.settings.size(),
                    kMaxSubmaps,
                    kMaxTextBytes));
  }
}

}  // namespace

void save_map(const std::filesystem::path& path, const StoredMap& stored) {
  WAYMARK_CHECK(stored.map != nullptr);
  const Map& map = *stored.map;
  const RigTable rigs(map);
  AtomicFile file(path);
  MapRecordWriter writer(file, path.string());
  writer.write_header(kVersion, kProducer);
  writer.begin("map", 0);
  check_counts(writer, stored);
  writer.add("end_keyframe", map.keyframes().end_id().value);
  writer.add("end_landmark", map.landmarks().end_id().value);
  writer.add_text("settings", stored.settings);
  writer.end();
  write_cameras(writer, rigs);
  write_submaps(writer, map);
  write_keyframes(writer, map, rigs);
  write_landmarks(writer, map);
  write_erased_keyframes(writer, map);
  write_merged_landmarks(writer, map);
  write_loop_edges(writer, map);
  write_markers(writer, map);
  write_images(writer, stored);
  writer.write_counts();
  file.commit();
}

}  // namespace waymark
