// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>

#include "waymark/view/scene.h"

namespace waymark {
namespace {

constexpr int kSteps = 40;

/// The direction of the outermost pixel between the centre of an image and a corner; 0 if there is
/// none.
Eigen::Vector3d direction_towards(const Camera& camera, const Eigen::Vector2d& corner_px) {
  const Eigen::Vector2d centre_px(0.5 * (camera.width_px() - 1), 0.5 * (camera.height_px() - 1));
  if (!camera.can_project()) {  // As if it saw 90 degrees, so that there is something to see.
    return ((corner_px - centre_px) / centre_px.x()).homogeneous().normalized();
  }
  for (int step = kSteps; step > 0; --step) {
    const Eigen::Vector2d pixel = centre_px + step * (corner_px - centre_px) / kSteps;
    Eigen::Vector3d bearing;
    std::uint8_t is_valid = 0;
    camera.unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
    if (is_valid) return bearing;
  }
  return Eigen::Vector3d::Zero();
}

constexpr std::size_t kMaxEdges = 10;
constexpr std::uint32_t kMinShared = 15;

std::uint32_t num_landmarks(const Keyframe& keyframe) {
  return static_cast<std::uint32_t>(
      std::ranges::count_if(keyframe.landmarks, &LandmarkId::is_valid));
}

bool is_same_otherwise(const Keyframe& a, const Keyframe& b) {
  return a.submap == b.submap && a.parent == b.parent && num_landmarks(a) == num_landmarks(b);
}

void add_poses(const Map& map, std::span<const KeyframeId> ids, MessageWriter& writer) {
  const auto world_from_rig = [&](KeyframeId id) {
    return map.keyframes().at(id).rig_from_world.inverse();
  };
  for (const KeyframeId id : ids) writer.add(id.value);
  for (const KeyframeId id : ids) writer.add(world_from_rig(id).translation);
  for (const KeyframeId id : ids) writer.add(world_from_rig(id).rotation);
}

Message encode_poses(const Map& map, std::span<const KeyframeId> ids) {
  MessageWriter writer(MessageKind::kKeyframePoses, ids.size());
  add_poses(map, ids, writer);
  return writer.finish();
}

Message encode_covisibility(const Map& map, std::span<const KeyframeId> ids) {
  std::vector<CovisibilityEdge> edges;
  MessageWriter writer(MessageKind::kCovisibility, ids.size());
  for (const KeyframeId id : ids) writer.add(id.value);
  for (const KeyframeId id : ids) {
    const auto told = strongest_older(map.covisibility().at(id), id);
    edges.insert(edges.end(), told.begin(), told.end());
    writer.add(static_cast<std::uint32_t>(edges.size()));
  }
  for (const CovisibilityEdge& edge : edges) writer.add(edge.keyframe.value);
  for (const CovisibilityEdge& edge : edges) writer.add(saturate16(edge.num_shared));
  writer.pad_to(4);
  return writer.finish();
}

std::vector<KeyframeId> changed_covisibility(const Map& before, const Map& after) {
  std::vector<KeyframeId> changed;
  after.covisibility().for_each_difference(
      before.covisibility(), [&](KeyframeId id, const Covisibility* old, const Covisibility* now) {
        if (!now) return;
        const auto told = old ? strongest_older(*old, id) : std::vector<CovisibilityEdge>();
        if (told != strongest_older(*now, id)) changed.push_back(id);
      });
  return changed;
}

Message encode_loops(const Map& map) {
  const std::vector<LoopEdge>& edges = map.measured_loop_edges();
  MessageWriter writer(MessageKind::kLoops, edges.size());
  for (const LoopEdge& edge : edges) writer.add(edge.from.value);
  for (const LoopEdge& edge : edges) writer.add(edge.to.value);
  return writer.finish();
}

Message encode_submaps(const Map& map) {
  MessageWriter writer(MessageKind::kSubmaps, map.submaps().size());
  for (const Submap& submap : map.submaps()) writer.add(submap.joined_into.value);
  for (const Submap& submap : map.submaps()) writer.add(std::uint32_t{submap.is_metric});
  return writer.finish();
}

bool are_same_submaps(const Map& a, const Map& b) {
  return std::ranges::equal(a.submaps(), b.submaps(), [](const Submap& x, const Submap& y) {
    return x.joined_into == y.joined_into && x.is_metric == y.is_metric;
  });
}

}  // namespace

CameraShape shape_of(const RigCamera& rig_camera) {
  const Camera& camera = *rig_camera.camera;
  CameraShape shape;
  shape.position_in_rig = rig_camera.cam_from_rig.origin_in_source();
  shape.is_sphere = camera.wrap_width_px() > 0.0;
  if (shape.is_sphere) return shape;
  const double right = camera.width_px() - 1;
  const double bottom = camera.height_px() - 1;
  const std::array<Eigen::Vector2d, 4> corners_px{Eigen::Vector2d(0, 0),
                                                  Eigen::Vector2d(right, 0),
                                                  Eigen::Vector2d(right, bottom),
                                                  Eigen::Vector2d(0, bottom)};
  for (std::size_t i = 0; i < corners_px.size(); ++i) {
    shape.corners_in_rig[i] =
        rig_camera.cam_from_rig.rotation.conjugate() * direction_towards(camera, corners_px[i]);
  }
  return shape;
}

std::vector<CovisibilityEdge> strongest_older(const Covisibility& covisibility, KeyframeId id) {
  std::vector<CovisibilityEdge> older;
  for (const CovisibilityEdge& edge : covisibility.edges) {
    if (edge.keyframe < id && edge.num_shared >= kMinShared) older.push_back(edge);
  }
  if (older.size() > kMaxEdges) {
    std::ranges::stable_sort(older, std::greater(), &CovisibilityEdge::num_shared);
    older.resize(kMaxEdges);
    std::ranges::sort(older, {}, &CovisibilityEdge::keyframe);
  }
  return older;
}

void KeyframeLayer::differences(const Map& before,
                                const Map& after,
                                std::int64_t start_ns,
                                std::vector<Message>& messages) {
  if (learn_rigs(before, after)) messages.push_back(encode_cameras());
  if (!are_same_submaps(before, after)) messages.push_back(encode_submaps(after));
  std::vector<KeyframeId> changed;
  std::vector<KeyframeId> moved;
  std::vector<std::uint32_t> erased;
  after.keyframes().for_each_difference(
      before.keyframes(), [&](KeyframeId id, const Keyframe* old, const Keyframe* now) {
        if (!now) {
          erased.push_back(id.value);
        } else if (!old || !is_same_otherwise(*old, *now)) {
          changed.push_back(id);
        } else if (!is_same_pose(*old, *now)) {
          moved.push_back(id);
        }
      });
  add_chunks(
      erased, messages, [&](auto ids) { return encode_ids(MessageKind::kKeyframesErased, ids); });
  add_chunks(changed, messages, [&](auto ids) { return encode(after, ids, start_ns); });
  add_chunks(moved, messages, [&](auto ids) { return encode_poses(after, ids); });
  add_chunks(changed_covisibility(before, after), messages, [&](auto ids) {
    return encode_covisibility(after, ids);
  });
  // They are only ever added.
  if (before.measured_loop_edges().size() != after.measured_loop_edges().size()) {
    messages.push_back(encode_loops(after));
  }
}

void KeyframeLayer::snapshot(const Map& map,
                             std::int64_t start_ns,
                             std::vector<Message>& messages) {
  learn_rigs(Map(), map);
  messages.push_back(encode_cameras());
  messages.push_back(encode_submaps(map));
  std::vector<KeyframeId> all;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { all.push_back(id); });
  add_chunks(all, messages, [&](auto ids) { return encode(map, ids, start_ns); });
  add_chunks(all, messages, [&](auto ids) { return encode_covisibility(map, ids); });
  messages.push_back(encode_loops(map));
}

std::uint16_t KeyframeLayer::rig_of(const Keyframe& keyframe) const {
  const auto found = std::find(rigs_.begin(), rigs_.end(), keyframe.features->rig);
  return saturate16(static_cast<std::size_t>(found - rigs_.begin()));
}

bool KeyframeLayer::learn_rigs(const Map& before, const Map& after) {
  const std::size_t num_before = rigs_.size();
  after.keyframes().for_each_difference(before.keyframes(),
                                        [&](KeyframeId, const Keyframe* old, const Keyframe* now) {
                                          if (old || !now || rig_of(*now) < rigs_.size()) return;
                                          rigs_.push_back(now->features->rig);
                                        });
  return rigs_.size() > num_before;
}

Message KeyframeLayer::encode_cameras() const {
  std::vector<CameraShape> shapes;
  for (std::uint32_t rig = 0; rig < rigs_.size(); ++rig) {
    for (const RigCamera& camera : rigs_[rig]->cameras) {
      shapes.push_back(shape_of(camera));
      shapes.back().rig = rig;
    }
  }
  MessageWriter writer(MessageKind::kCameras, shapes.size());
  for (const CameraShape& shape : shapes) writer.add(std::uint32_t{shape.is_sphere});
  for (const CameraShape& shape : shapes) writer.add(shape.rig);
  for (const CameraShape& shape : shapes) writer.add(shape.position_in_rig);
  for (const CameraShape& shape : shapes) {
    for (const Eigen::Vector3d& corner : shape.corners_in_rig) writer.add(corner);
  }
  return writer.finish();
}

Message KeyframeLayer::encode(const Map& map,
                              std::span<const KeyframeId> ids,
                              std::int64_t start_ns) const {
  const auto& keyframes = map.keyframes();
  MessageWriter writer(MessageKind::kKeyframes, ids.size());
  add_poses(map, ids, writer);
  for (const KeyframeId id : ids) writer.add(keyframes.at(id).frame.value);
  for (const KeyframeId id : ids) {
    writer.add(seconds_between(start_ns, keyframes.at(id).timestamp_ns));
  }
  for (const KeyframeId id : ids) writer.add(keyframes.at(id).parent.value);
  for (const KeyframeId id : ids) writer.add(num_landmarks(keyframes.at(id)));
  for (const KeyframeId id : ids) writer.add(rig_of(keyframes.at(id)));
  for (const KeyframeId id : ids) writer.add(saturate16(keyframes.at(id).submap.value));
  return writer.finish();
}

}  // namespace waymark
