// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/image/image_header.h"
#include "waymark/mapfile/map_imu.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/map_odometry.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxCameraNumbers = 16;
constexpr std::uint64_t kMaxImageSizePx = 1u << 16;

/// The row of an id, or the end.
template <class Rows, class IdType>
auto find_row(Rows& rows, IdType id) {
  const auto at = std::lower_bound(
      rows.begin(), rows.end(), id, [](const auto& row, IdType wanted) { return row.id < wanted; });
  return at != rows.end() && at->id == id ? at : rows.end();
}

void read_landmarks_of(MapRecord& record, Keyframe& keyframe) {
  keyframe.landmarks = record.array<LandmarkId>("landmark", keyframe.features->size());
  // Earlier maps have those of camera 1, too.
  const auto begin_of_camera1 =
      keyframe.landmarks.begin() + static_cast<std::ptrdiff_t>(keyframe.features->num_primary);
  std::fill(begin_of_camera1, keyframe.landmarks.end(), LandmarkId{});
}

template <class Stored, class IdType>
bool is_among(const std::vector<Stored>& stored, IdType id) {
  return find_row(stored, id) != stored.end();
}

/// Takes rows out whose ids are among some in any order.
template <class Stored, class IdType>
void drop(std::vector<Stored>& rows, std::vector<IdType> ids) {
  if (ids.empty()) return;
  std::sort(ids.begin(), ids.end());
  std::erase_if(
      rows, [&](const Stored& row) { return std::binary_search(ids.begin(), ids.end(), row.id); });
}

}  // namespace

struct MapReader::Kind {
  std::string_view name;
  bool is_counted;  // Ids count up from 0; else they are ids of the map, which ascend.
  void (MapReader::*read)(MapRecord&);
  bool is_of_changes = false;  // In journals only.
};

const std::vector<MapReader::Kind>& MapReader::kinds() {
  static const std::vector<Kind> kKinds = {
      {"map", true, &MapReader::read_map},
      {"camera", true, &MapReader::read_camera},
      {"submap", true, &MapReader::read_submap},
      {"keyframe", false, &MapReader::read_keyframe},
      {"keyframe_state", false, &MapReader::read_keyframe_state, true},
      {"landmarks", true, &MapReader::read_landmarks},
      {"erased_landmarks", true, &MapReader::read_erased_landmarks, true},
      {"erased_keyframe", false, &MapReader::read_erased_keyframe},
      {"merged_landmarks", true, &MapReader::read_merged_landmarks},
      {"loop_edge", true, &MapReader::read_loop_edge},
      {"odometry", true, &MapReader::read_odometry},
      {"marker", true, &MapReader::read_marker},
      {"imu", true, &MapReader::read_imu},
      {"image", false, &MapReader::read_image}};
  return kKinds;
}

void MapReader::add(MapRecord& record, const std::string& kind) {
  const auto at = std::find_if(
      kinds().begin(), kinds().end(), [&](const Kind& known) { return known.name == kind; });
  if (at == kinds().end() || (at->is_of_changes && !has_changes_)) {
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
  const bool is_camera = kinds()[kind].read == &MapReader::read_camera;
  const std::uint64_t expected = is_camera ? num_cameras_ : num_before;
  if (kinds()[kind].is_counted && id != expected) {
    record.fail(fmt::format("has the id {}, expected {}", id, expected));
  }
  if (num_before > 0 && id <= id_) {
    record.fail(fmt::format("comes after that of id {}, expected ids that ascend", id_));
  }
  kind_ = kind;
  id_ = id;
}

/// Of the end of the file or of the change before.
void MapReader::end(MapRecord& record) {
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
  has_changes_ = true;
  kind_ = 0;
  id_ = 0;
  counts_.clear();
  last_landmark_ = last_erased_ = last_merged_ = {};
  last_noted_ = {};
  num_rigs_before_ = rigs_.size();
}

/// What a change has as a whole takes the place of what there was.
void MapReader::begin_change() {
  parts_.submaps.clear();
  parts_.merged_landmarks.clear();
  parts_.loop_edges.clear();
  parts_.markers.clear();
}

void MapReader::read_map(MapRecord& record) {
  if (counts_["map"] > 1) record.fail("is the second of its kind, expected one");
  if (has_changes_) begin_change();
  const KeyframeId end_keyframe = std::exchange(parts_.end_keyframe, KeyframeId{0});
  const LandmarkId end_landmark = std::exchange(parts_.end_landmark, LandmarkId{0});
  parts_.end_keyframe.value = static_cast<std::uint32_t>(record.whole("end_keyframe", kMaxIds));
  parts_.end_landmark.value = static_cast<std::uint32_t>(record.whole("end_landmark", kMaxIds));
  if (has_changes_ && (parts_.end_keyframe < end_keyframe || parts_.end_landmark < end_landmark)) {
    record.fail("has ends before those of earlier, expected ids to ascend");
  }
  stored_.settings = record.text("settings", kMaxTextBytes);
}

/// Adds a row whose id is above all there are, or replaces the one of its id.
template <class Stored>
void MapReader::put(const MapRecord& record, std::vector<Stored>& rows, Stored row) const {
  if (rows.empty() || rows.back().id < row.id) {
    rows.push_back(std::move(row));
    return;
  }
  const auto at = find_row(rows, row.id);
  if (at == rows.end()) {
    record.fail(fmt::format("has the id {}, expected one that was there or one above {}",
                            row.id.value,
                            rows.back().id.value));
  }
  *at = std::move(row);
}

void MapReader::read_camera(MapRecord& record) {
  const std::uint64_t rig = record.whole("rig", rigs_.size());
  const std::size_t first_rig =
      std::max(num_rigs_before_, std::max<std::size_t>(rigs_.size(), 1) - 1);
  if (rig < first_rig) {
    record.fail(fmt::format("belongs to rig {}, expected those of rig {}", rig, first_rig));
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
  ++num_cameras_;
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
  keyframe.features = read_features(record, read_rig(record));
  read_state(record, keyframe);
  keyframe.markers = read_markers(record, keyframe.rig());
  put(record, parts_.keyframes, std::move(stored));
}

void MapReader::read_keyframe_state(MapRecord& record) {
  const auto at = find_row(parts_.keyframes, KeyframeId{static_cast<std::uint32_t>(id_)});
  if (at == parts_.keyframes.end()) record.fail("expected the id of a keyframe");
  if (read_rig(record) != at->keyframe.features->rig) {
    record.fail("has another rig, expected the one that its features are of");
  }
  read_state(record, at->keyframe);
}

std::shared_ptr<const Rig> MapReader::read_rig(MapRecord& record) const {
  return rigs_[record.whole("rig", rigs_.size() - 1)];
}

/// What the mapper may change.
void MapReader::read_state(MapRecord& record, Keyframe& keyframe) {
  keyframe.submap = record.id<SubmapId>("submap", parts_.submaps.size());
  keyframe.parent = record.id<KeyframeId>("parent", parts_.end_keyframe.value);
  keyframe.rig_from_world = record.transform("rig_from_world");
  keyframe.applied_scale = record.number("applied_scale", kScaleRange);
  read_landmarks_of(record, keyframe);
}

std::vector<LandmarkId> MapReader::read_landmark_ids(MapRecord& record, LandmarkId& last) const {
  return record.ascending_ids("landmark", kLandmarksPerRecord, parts_.end_landmark, last);
}

void MapReader::read_landmarks(MapRecord& record) {
  const std::vector<LandmarkId> ids = read_landmark_ids(record, last_landmark_);
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
    put(record, parts_.landmarks, std::move(stored));
  }
}

void MapReader::read_erased_landmarks(MapRecord& record) {
  const std::vector<LandmarkId> ids = read_landmark_ids(record, last_erased_);
  erased_landmarks_.insert(erased_landmarks_.end(), ids.begin(), ids.end());
}

void MapReader::read_erased_keyframe(MapRecord& record) {
  KeyframeForwarding forwarding;
  forwarding.heir = record.id<KeyframeId>("heir", parts_.end_keyframe.value);
  forwarding.rig_from_heir = record.transform("rig_from_heir");
  forwarding.heir_scale = record.number("heir_scale", kScaleRange);
  forwarding.scale = record.number("scale", kScaleRange);
  const KeyframeId id{static_cast<std::uint32_t>(id_)};
  parts_.erased_keyframes.push_back({id, forwarding});
  if (has_changes_) erased_keyframes_.push_back(id);
}

void MapReader::read_merged_landmarks(MapRecord& record) {
  const std::vector<LandmarkId> ids = read_landmark_ids(record, last_merged_);
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

void MapReader::read_odometry(MapRecord& record) {
  for (const MapParts::StoredOdometry& noted :
       waymark::read_odometry(record, parts_.end_keyframe, last_noted_)) {
    put(record, parts_.odometry, noted);
  }
}

void MapReader::read_imu(MapRecord& record) {
  if (counts_["imu"] > 1) record.fail("is a second one, expected one at most");
  stored_.imu = waymark::read_imu(record);
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
    record.fail(fmt::format("jpeg is {}x{} px, expected at most {} megapixels and {} px a side",
                            size->width_px,
                            size->height_px,
                            kMaxMegapixels,
                            kMaxSidePx));
  }
  stored_.images.insert_or_assign(keyframe, std::move(jpeg));
}

/// What Map::restore() asks for.
void MapReader::check_ids() const {
  KeyframeId last;
  for (const MapParts::ErasedKeyframe& erased : parts_.erased_keyframes) {
    const bool is_new = !last.is_valid() || erased.id > last;
    last = erased.id;
    if (is_new && erased.id < parts_.end_keyframe && !is_among(parts_.keyframes, erased.id)) {
      continue;
    }
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

/// What changes say to be gone: rows of it may have come in between.
void MapReader::drop_erased() {
  for (const KeyframeId id : erased_keyframes_) stored_.images.erase(id);
  drop(parts_.keyframes, std::move(erased_keyframes_));
  drop(parts_.landmarks, std::move(erased_landmarks_));
  const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
  std::stable_sort(parts_.erased_keyframes.begin(), parts_.erased_keyframes.end(), by_id);
}

StoredMap MapReader::finish() {
  drop_erased();
  check_ids();
  stored_.map = Map::restore(std::move(parts_)).freeze();
  return std::move(stored_);
}

}  // namespace waymark
