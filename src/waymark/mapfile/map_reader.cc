// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/image/image_header.h"
#include "waymark/mapfile/map_layout.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxCameraNumbers = 16;
constexpr std::uint64_t kMaxImageSizePx = 1u << 16;

template <class Stored, class IdType>
bool is_among(const std::vector<Stored>& stored, IdType id) {
  const auto at =
      std::lower_bound(stored.begin(), stored.end(), id, [](const Stored& row, IdType wanted) {
        return row.id < wanted;
      });
  return at != stored.end() && at->id == id;
}

}  // namespace

struct MapReader::Kind {
  std::string_view name;
  bool is_counted;  // Ids count up from 0; else they are ids of the map, which ascend.
  void (MapReader::*read)(MapRecord&);
};

const std::vector<MapReader::Kind>& MapReader::kinds() {
  static const std::vector<Kind> kKinds = {
      {"map", true, &MapReader::read_map},
      {"camera", true, &MapReader::read_camera},
      {"submap", true, &MapReader::read_submap},
      {"keyframe", false, &MapReader::read_keyframe},
      {"landmarks", true, &MapReader::read_landmarks},
      {"erased_keyframe", false, &MapReader::read_erased_keyframe},
      {"merged_landmarks", true, &MapReader::read_merged_landmarks},
      {"loop_edge", true, &MapReader::read_loop_edge},
      {"marker", true, &MapReader::read_marker},
      {"image", false, &MapReader::read_image}};
  return kKinds;
}

void MapReader::add(MapRecord& record, const std::string& kind) {
  const auto at = std::find_if(
      kinds().begin(), kinds().end(), [&](const Kind& known) { return known.name == kind; });
  if (at == kinds().end()) {
    record.fail(fmt::format("has the kind {}, expected one of version 1", quote_for_message(kind)));
  }
  const auto place = static_cast<std::size_t>(at - kinds().begin());
  check_order(record, place, record.whole("id", kMaxIds - 1));
  (this->*at->read)(record);
  record.expect_no_more();
}

void MapReader::check_order(const MapRecord& record, std::size_t kind, std::uint64_t id) {
  if (counts_.empty() && kind != 0) record.fail("comes first, expected a record of the kind map");
  if (kind < kind_) {
    record.fail(
        fmt::format("comes after one of the kind {}, expected it before", kinds()[kind_].name));
  }
  const std::uint64_t num_before = counts_[std::string(kinds()[kind].name)]++;
  if (kinds()[kind].is_counted && id != num_before) {
    record.fail(fmt::format("has the id {}, expected {}", id, num_before));
  }
  if (num_before > 0 && id <= id_) {
    record.fail(fmt::format("comes after that of id {}, expected ids that ascend", id_));
  }
  kind_ = kind;
  id_ = id;
}

void MapReader::read_map(MapRecord& record) {
  if (counts_["map"] > 1) record.fail("is the second of its kind, expected one");
  parts_.end_keyframe.value = static_cast<std::uint32_t>(record.whole("end_keyframe", kMaxIds));
  parts_.end_landmark.value = static_cast<std::uint32_t>(record.whole("end_landmark", kMaxIds));
  stored_.settings = record.text("settings", kMaxTextBytes);
}

void MapReader::read_camera(MapRecord& record) {
  const std::uint64_t rig = record.whole("rig", rigs_.size());
  if (rig + 1 < rigs_.size()) {
    record.fail(fmt::format("belongs to rig {}, expected those of rig {}", rig, rigs_.size() - 1));
  }
  if (rig == rigs_.size()) rigs_.push_back(std::make_shared<Rig>());
  if (rigs_.back()->cameras.size() == kMaxCamerasPerRig) {
    record.fail(fmt::format("is one too many in rig {}, expected {}", rig, kMaxCamerasPerRig));
  }
  CameraDescription description;
  description.where = record.where();
  description.camera_model = record.text("camera_model", kMaxTextBytes);
  description.intrinsics = record.numbers("intrinsics", kMaxCameraNumbers);
  description.distortion_model = record.text("distortion_model", kMaxTextBytes);
  description.distortion_coeffs = record.numbers("distortion_coeffs", kMaxCameraNumbers);
  description.width_px = static_cast<int>(record.whole("width_px", kMaxImageSizePx));
  description.height_px = static_cast<int>(record.whole("height_px", kMaxImageSizePx));
  const Rigid3 cam_from_rig = record.transform("cam_from_rig");
  rigs_.back()->cameras.push_back(
      {registry_.make_stored_camera(description), cam_from_rig, description});
}

void MapReader::read_submap(MapRecord& record) {
  Submap submap;
  submap.is_metric = record.flag("is_metric");
  submap.root = record.id<KeyframeId>("root", parts_.end_keyframe.value);
  submap.joined_into = record.id<SubmapId>("joined_into", kMaxSubmaps);
  if (parts_.submaps.size() == kMaxSubmaps) record.fail("is one too many");
  parts_.submaps.push_back(submap);
}

void MapReader::read_keyframe(MapRecord& record) {
  MapParts::StoredKeyframe stored{KeyframeId{static_cast<std::uint32_t>(id_)}, {}};
  if (stored.id >= parts_.end_keyframe) {
    record.fail(fmt::format("expected ids below {}", parts_.end_keyframe.value));
  }
  if (rigs_.empty()) record.fail("comes without a camera, expected one before");
  Keyframe& keyframe = stored.keyframe;
  keyframe.frame = FrameId{static_cast<std::uint32_t>(record.whole("frame", UINT32_MAX))};
  keyframe.timestamp_ns = record.signed_whole("timestamp_ns");
  keyframe.rig = rigs_[record.whole("rig", rigs_.size() - 1)];
  keyframe.submap = record.id<SubmapId>("submap", parts_.submaps.size());
  keyframe.parent = record.id<KeyframeId>("parent", parts_.end_keyframe.value);
  keyframe.rig_from_world = record.transform("rig_from_world");
  keyframe.applied_scale = record.number("applied_scale", kScaleRange);
  keyframe.features = read_features(record, *keyframe.rig);
  keyframe.landmarks = record.array<LandmarkId>("landmark", keyframe.features->size());
  // Earlier maps have those of camera 1, too.
  const auto begin_of_camera1 =
      keyframe.landmarks.begin() + static_cast<std::ptrdiff_t>(keyframe.features->num_primary);
  std::fill(begin_of_camera1, keyframe.landmarks.end(), LandmarkId{});
  keyframe.markers = read_markers(record, *keyframe.rig);
  parts_.keyframes.push_back(std::move(stored));
}

/// Ids of landmarks, ascending within the record and after those of the records before.
template <class Stored>
std::vector<LandmarkId> MapReader::read_landmark_ids(MapRecord& record,
                                                     const std::vector<Stored>& before) {
  const auto ids = record.array<LandmarkId>("landmark", std::nullopt);
  if (ids.empty() || ids.size() > kLandmarksPerRecord) {
    record.fail(fmt::format("has {} landmarks, expected 1 to {}", ids.size(), kLandmarksPerRecord));
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const bool is_first = i == 0 && before.empty();
    const LandmarkId last = i > 0 ? ids[i - 1] : (is_first ? LandmarkId{} : before.back().id);
    if (ids[i] >= parts_.end_landmark || (!is_first && ids[i] <= last)) {
      record.fail(fmt::format("has landmark {} after {}, expected ids that ascend below {}",
                              ids[i].value,
                              is_first ? "none" : fmt::format("{}", last.value),
                              parts_.end_landmark.value));
    }
  }
  return ids;
}

void MapReader::read_landmarks(MapRecord& record) {
  const std::vector<LandmarkId> ids = read_landmark_ids(record, parts_.landmarks);
  const std::size_t count = ids.size();
  const auto submaps = record.array<SubmapId>("submap", count);
  const auto positions = record.array<Eigen::Vector3d>("position_in_world", count, kLengthRange);
  const auto references = record.array<KeyframeId>("reference", count);
  const auto num_visible = record.array<std::uint32_t>("num_visible", count);
  const auto num_found = record.array<std::uint32_t>("num_found", count);
  const auto descriptors = record.array<Descriptor>("descriptor", count);
  const auto directions = record.array<Eigen::Vector3d>("direction", count, kDirectionRange);
  const auto sizes_m = record.array<double>("size_m", count, kLandmarkSizeRange);
  auto across = std::vector<Eigen::Vector3d>(count, Eigen::Vector3d::Zero());
  if (record.has("across")) {
    across = record.array<Eigen::Vector3d>("across", count, kDirectionRange);
  }
  for (std::size_t i = 0; i < count; ++i) {
    MapParts::StoredLandmark stored{ids[i], {}};
    stored.landmark.submap = submaps[i];
    stored.landmark.position_in_world = positions[i];
    stored.landmark.reference = references[i];
    stored.landmark.num_visible = num_visible[i];
    stored.landmark.num_found = num_found[i];
    stored.landmark.appearance = {descriptors[i], directions[i], sizes_m[i], across[i]};
    parts_.landmarks.push_back(std::move(stored));
  }
}

void MapReader::read_erased_keyframe(MapRecord& record) {
  KeyframeForwarding forwarding;
  forwarding.heir = record.id<KeyframeId>("heir", parts_.end_keyframe.value);
  forwarding.rig_from_heir = record.transform("rig_from_heir");
  forwarding.heir_scale = record.number("heir_scale", kScaleRange);
  forwarding.scale = record.number("scale", kScaleRange);
  parts_.erased_keyframes.push_back({KeyframeId{static_cast<std::uint32_t>(id_)}, forwarding});
}

void MapReader::read_merged_landmarks(MapRecord& record) {
  const std::vector<LandmarkId> ids = read_landmark_ids(record, parts_.merged_landmarks);
  const auto survivors = record.array<LandmarkId>("survivor", ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    parts_.merged_landmarks.push_back({ids[i], survivors[i]});
  }
}

void MapReader::read_loop_edge(MapRecord& record) {
  LoopEdge edge;
  edge.from = record.id<KeyframeId>("from", parts_.end_keyframe.value);
  edge.to = record.id<KeyframeId>("to", parts_.end_keyframe.value);
  const Rigid3 rigid = record.transform("to_from_from");
  edge.to_from_from = {rigid.rotation, rigid.translation, record.number("scale", kScaleRange)};
  parts_.loop_edges.push_back(edge);
}

void MapReader::read_marker(MapRecord& record) {
  MapMarker marker;
  marker.id = static_cast<int>(record.whole("number", kMaxMarkerNumber));
  marker.side_m = record.number("side_m", kMarkerSideRange);
  marker.reference = record.id<KeyframeId>("reference", parts_.end_keyframe.value);
  if (!marker.reference.is_valid()) record.fail("has no reference, expected a keyframe");
  marker.reference_scale = record.number("reference_scale", kScaleRange);
  marker.marker_from_reference = record.transform("marker_from_reference");
  if (record.has("surveyed_world_from_marker")) {
    marker.surveyed_world_from_marker = record.transform("surveyed_world_from_marker");
  }
  if (!parts_.markers.empty() && marker.id < parts_.markers.back().id) {
    record.fail(fmt::format("has number {} after {}, expected numbers that do not descend",
                            marker.id,
                            parts_.markers.back().id));
  }
  parts_.markers.push_back(marker);
}

void MapReader::read_image(MapRecord& record) {
  const KeyframeId keyframe{static_cast<std::uint32_t>(id_)};
  if (!is_among(parts_.keyframes, keyframe)) record.fail("expected the id of a keyframe");
  auto jpeg = std::make_shared<const std::string>(record.bytes("jpeg"));
  const std::optional<ImageSize> size = size_in_header(*jpeg);
  if (size && is_too_large(*size)) {
    record.fail(fmt::format("jpeg is {}x{} px, expected at most {} megapixels",
                            size->width_px,
                            size->height_px,
                            kMaxMegapixels));
  }
  stored_.images.emplace(keyframe, std::move(jpeg));
}

/// What Map::restore() asks for.
void MapReader::check_ids() const {
  for (const MapParts::ErasedKeyframe& erased : parts_.erased_keyframes) {
    if (erased.id < parts_.end_keyframe && !is_among(parts_.keyframes, erased.id)) continue;
    throw InputError(
        fmt::format("{}: erased_keyframe {}", name_, erased.id.value),
        fmt::format("expected an id below {} that no keyframe has", parts_.end_keyframe.value));
  }
  for (const MapParts::MergedLandmark& merged : parts_.merged_landmarks) {
    if (!is_among(parts_.landmarks, merged.id)) continue;
    throw InputError(fmt::format("{}: merged_landmarks", name_),
                     fmt::format("landmark {} is there, too, expected it gone", merged.id.value));
  }
  const std::size_t num_keyframes = parts_.keyframes.size() + parts_.erased_keyframes.size();
  if (num_keyframes != parts_.end_keyframe.value) {
    throw InputError(fmt::format("{}: map 0", name_),
                     fmt::format("end_keyframe is {}, expected {}, the number of keyframes with "
                                 "the erased",
                                 parts_.end_keyframe.value,
                                 num_keyframes));
  }
}

StoredMap MapReader::finish(MapRecord& record) {
  const auto stated = record.counts("counts");
  if (!std::equal(stated.begin(),
                  stated.end(),
                  counts_.begin(),
                  counts_.end(),
                  [](const auto& a, const auto& b) {
                    return a.first == b.first && a.second == b.second;
                  })) {
    record.fail("has other counts than there are records, expected all that were written");
  }
  record.expect_no_more();
  if (counts_.empty()) record.fail("comes first, expected a record of the kind map");
  check_ids();
  stored_.map = Map::restore(std::move(parts_)).freeze();
  return std::move(stored_);
}

}  // namespace waymark
