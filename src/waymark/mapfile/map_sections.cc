// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_sections.h"

#include <fmt/format.h>

#include <algorithm>

#include "waymark/base/check.h"
#include "waymark/camera/rig.h"
#include "waymark/image/image_header.h"
#include "waymark/mapfile/map_layout.h"

namespace waymark {
namespace {

/// A member of every keypoint.
template <class T>
std::vector<T> column(const FeatureArray<Keypoint>& keypoints, T Keypoint::*member) {
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
  const FeatureArray<Keypoint>& keypoints = features.keypoints;
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

void add_markers(MapRecordWriter& writer, const MarkerObservations& observations) {
  std::vector<std::uint32_t> numbers;
  std::vector<std::uint8_t> cameras;
  std::vector<Eigen::Vector2f> pixels;
  std::vector<Eigen::Vector3f> bearings;
  std::vector<Matrix23f> slopes;
  for (const MarkerObservation& observation : observations) {
    numbers.push_back(static_cast<std::uint32_t>(observation.id));
    cameras.push_back(observation.camera);
    pixels.insert(pixels.end(), observation.pixels.begin(), observation.pixels.end());
    bearings.insert(bearings.end(), observation.bearings.begin(), observation.bearings.end());
    const auto& of_corners = observation.pixel_from_bearing;
    slopes.insert(slopes.end(), of_corners.begin(), of_corners.end());
  }
  writer.add_array("marker", numbers);
  writer.add_array("marker_camera", cameras);
  writer.add_array("marker_pixel", pixels);
  writer.add_array("marker_bearing", bearings);
  writer.add_array("marker_pixel_from_bearing", slopes, kSlopeRange);
}

/// Gathers rows until there are enough for a record.
class LandmarkRows {
 public:
  explicit LandmarkRows(MapRecordWriter& writer) : writer_(writer) {}

  void add(LandmarkId id, const Landmark& landmark) {
    rows_.id.push_back(id);
    rows_.submap.push_back(landmark.submap);
    rows_.position_in_world.push_back(landmark.position_in_world);
    rows_.reference.push_back(landmark.reference);
    rows_.num_visible.push_back(landmark.num_visible);
    rows_.num_found.push_back(landmark.num_found);
    rows_.descriptor.push_back(landmark.appearance.descriptor);
    rows_.direction.push_back(landmark.appearance.direction);
    rows_.size_m.push_back(landmark.appearance.size_m);
    rows_.across.push_back(landmark.appearance.across);
    rows_.has_edges |= !rows_.across.back().isZero();
    if (rows_.id.size() == kLandmarksPerRecord) write();
  }

  void finish() {
    if (!rows_.id.empty()) write();
  }

 private:
  struct Rows {
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
  };

  void write() {
    writer_.begin("landmarks", record_id_++);
    writer_.add_array("landmark", rows_.id);
    writer_.add_array("submap", rows_.submap);
    writer_.add_array("position_in_world", rows_.position_in_world, kLengthRange);
    writer_.add_array("reference", rows_.reference);
    writer_.add_array("num_visible", rows_.num_visible);
    writer_.add_array("num_found", rows_.num_found);
    writer_.add_array("descriptor", rows_.descriptor);
    writer_.add_array("direction", rows_.direction, kDirectionRange);
    writer_.add_array("size_m", rows_.size_m, kLandmarkSizeRange);
    if (rows_.has_edges) writer_.add_array("across", rows_.across, kDirectionRange);
    writer_.end();
    rows_ = {};
  }

  MapRecordWriter& writer_;
  std::uint64_t record_id_ = 0;
  Rows rows_;
};

void check_cameras(const Rig& rig) {
  for (const RigCamera& camera : rig.cameras) {
    if (camera.description) continue;
    throw InputError("map",
                     fmt::format("holds a camera of the model {} that was made without a "
                                 "description, expected rigs made by make_rig()",
                                 camera.camera ? camera.camera->model() : "none"));
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

void write_camera(MapRecordWriter& writer,
                  std::uint64_t id,
                  std::size_t rig,
                  const RigCamera& camera) {
  const CameraDescription& description = *camera.description;
  writer.begin("camera", id);
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

/// What the mapper may change in a keyframe.
void add_state(MapRecordWriter& writer, const Keyframe& keyframe, const RigTable& rigs) {
  writer.add("rig", rigs.index_of(keyframe.rig()));
  writer.add_id("submap", keyframe.submap);
  writer.add_id("parent", keyframe.parent);
  writer.add_transform("rig_from_world", keyframe.rig_from_world);
  writer.add_number("applied_scale", keyframe.applied_scale, kScaleRange);
}

}  // namespace

std::string_view map_producer() { return "waymark " WAYMARK_VERSION; }

bool RigTable::contains(const Rig& rig) const {
  return std::any_of(
      rigs_.begin(), rigs_.end(), [&](const auto& known) { return is_same_rig(*known, rig); });
}

void RigTable::add(const Map& map) {
  const Rig* last = nullptr;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (&keyframe.rig() == last) return;
    last = &keyframe.rig();
    check_cameras(*last);
    if (!contains(*last)) rigs_.push_back(keyframe.features->rig);
  });
}

std::uint64_t RigTable::index_of(const Rig& rig) const {
  const auto at = std::find_if(
      rigs_.begin(), rigs_.end(), [&](const auto& known) { return is_same_rig(*known, rig); });
  WAYMARK_CHECK(at != rigs_.end());
  return static_cast<std::uint64_t>(at - rigs_.begin());
}

void RigTable::write_cameras(MapRecordWriter& writer, std::size_t first_rig) const {
  std::uint64_t id = 0;
  for (std::size_t rig = 0; rig < rigs_.size(); ++rig) {
    for (const RigCamera& camera : rigs_[rig]->cameras) {
      if (rig >= first_rig) write_camera(writer, id, rig, camera);
      ++id;
    }
  }
}

void write_map_record(MapRecordWriter& writer, const StoredMap& stored) {
  const Map& map = *stored.map;
  writer.begin("map", 0);
  check_counts(writer, stored);
  writer.add("end_keyframe", map.keyframes().end_id().value);
  writer.add("end_landmark", map.landmarks().end_id().value);
  writer.add_text("settings", stored.settings);
  writer.end();
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

void write_keyframe(MapRecordWriter& writer,
                    KeyframeId id,
                    const Keyframe& keyframe,
                    const RigTable& rigs) {
  writer.begin("keyframe", id.value);
  writer.add("frame", keyframe.frame.value);
  writer.add_signed("timestamp_ns", keyframe.timestamp_ns);
  add_state(writer, keyframe, rigs);
  add_features(writer, *keyframe.features);
  writer.add_array("landmark", keyframe.landmarks);
  if (keyframe.markers) add_markers(writer, *keyframe.markers);
  writer.end();
}

void write_keyframe_state(MapRecordWriter& writer,
                          KeyframeId id,
                          const Keyframe& keyframe,
                          const RigTable& rigs) {
  writer.begin("keyframe_state", id.value);
  add_state(writer, keyframe, rigs);
  writer.add_array("landmark", keyframe.landmarks);
  writer.end();
}

void write_landmarks(MapRecordWriter& writer, const Map& map) {
  LandmarkRows rows(writer);
  map.landmarks().for_each(
      [&](LandmarkId id, const Landmark& landmark) { rows.add(id, landmark); });
  rows.finish();
}

void write_landmarks(MapRecordWriter& writer, const Map& map, const std::vector<LandmarkId>& ids) {
  LandmarkRows rows(writer);
  for (const LandmarkId id : ids) rows.add(id, map.landmarks().at(id));
  rows.finish();
}

void write_erased_landmarks(MapRecordWriter& writer, const std::vector<LandmarkId>& ids) {
  std::uint64_t record_id = 0;
  for (std::size_t begin = 0; begin < ids.size(); begin += kLandmarksPerRecord) {
    const auto first = ids.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::size_t count = std::min(kLandmarksPerRecord, ids.size() - begin);
    writer.begin("erased_landmarks", record_id++);
    writer.add_array("landmark", std::vector(first, first + static_cast<std::ptrdiff_t>(count)));
    writer.end();
  }
}

void write_erased_keyframe(MapRecordWriter& writer,
                           KeyframeId id,
                           const KeyframeForwarding& forwarding) {
  writer.begin("erased_keyframe", id.value);
  writer.add_id("heir", forwarding.heir);
  writer.add_transform("rig_from_heir", forwarding.rig_from_heir);
  writer.add_number("heir_scale", forwarding.heir_scale, kScaleRange);
  writer.add_number("scale", forwarding.scale, kScaleRange);
  writer.end();
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

void write_image(MapRecordWriter& writer, KeyframeId id, const SharedJpeg& jpeg) {
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

}  // namespace waymark
