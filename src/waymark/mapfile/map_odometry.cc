// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_odometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "waymark/mapfile/map_layout.h"

namespace waymark {
namespace {

void write_record(MapRecordWriter& writer,
                  std::uint64_t record_id,
                  const Map& map,
                  std::span<const KeyframeId> ids) {
  std::vector<KeyframeId> parents;
  std::vector<Eigen::Vector4d> rotations;
  std::vector<Eigen::Vector3d> translations;
  std::vector<double> scales, depths;
  for (const KeyframeId id : ids) {
    const OdometryNode& node = map.odometry().at(id);
    parents.push_back(node.parent);
    rotations.push_back(node.rig_from_parent.rotation.coeffs());
    translations.push_back(node.rig_from_parent.translation);
    scales.push_back(node.rig_from_parent.scale);
    depths.push_back(node.depth);
  }
  writer.begin("odometry", record_id);
  writer.add_array("keyframe", std::vector<KeyframeId>(ids.begin(), ids.end()));
  writer.add_array("parent", parents);
  writer.add_array("rotation", rotations, kDirectionRange);
  writer.add_array("translation", translations, kLengthRange);
  writer.add_array("scale", scales, kScaleRange);
  writer.add_array("depth", depths, kDepthRange);
  writer.end();
}

}  // namespace

void write_odometry(MapRecordWriter& writer, const Map& map) {
  std::vector<KeyframeId> ids;
  map.odometry().for_each([&](KeyframeId id, const OdometryNode&) { ids.push_back(id); });
  write_odometry(writer, map, ids);
}

void write_odometry(MapRecordWriter& writer, const Map& map, const std::vector<KeyframeId>& ids) {
  std::uint64_t record_id = 0;
  for (std::size_t first = 0; first < ids.size(); first += kKeyframesPerRecord) {
    const std::size_t count = std::min(kKeyframesPerRecord, ids.size() - first);
    write_record(writer, record_id++, map, std::span(ids).subspan(first, count));
  }
}

std::vector<MapParts::StoredOdometry> read_odometry(MapRecord& record,
                                                    KeyframeId end,
                                                    KeyframeId& last) {
  const auto ids = record.ascending_ids("keyframe", kKeyframesPerRecord, end, last);
  const std::size_t count = ids.size();
  const auto parents = record.array<KeyframeId>("parent", count);
  const auto rotations = record.array<Eigen::Vector4d>("rotation", count, kDirectionRange);
  const auto translations = record.array<Eigen::Vector3d>("translation", count, kLengthRange);
  const auto scales = record.array<double>("scale", count, kScaleRange);
  const auto depths = record.array<double>("depth", count, kDepthRange);
  std::vector<MapParts::StoredOdometry> rows;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Quaterniond rotation(rotations[i]);
    if (!(std::abs(rotation.norm() - 1.0) <= kMaxNormError)) {
      record.fail(fmt::format(
          "rotation {} has the length {}, expected a unit quaternion", i, rotation.norm()));
    }
    rows.push_back({ids[i], {parents[i], {rotation, translations[i], scales[i]}, depths[i]}});
  }
  return rows;
}

}  // namespace waymark
