// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/map.h"

#include <algorithm>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Distinct keyframes of ascending observations, without one.
std::vector<KeyframeId> observers_except(const Landmark& landmark, KeyframeId except) {
  std::vector<KeyframeId> observers;
  for (const Observation& observation : landmark.observations) {
    const KeyframeId id = observation.keyframe;
    if (id != except && (observers.empty() || observers.back() != id)) observers.push_back(id);
  }
  return observers;
}

}  // namespace

bool is_metric(const Map& map) {
  return std::all_of(map.submaps().begin(), map.submaps().end(), [](const Submap& submap) {
    return submap.joined_into.is_valid() || submap.is_metric;
  });
}

std::shared_ptr<const Map> Map::freeze() {
  auto frozen = std::make_shared<Map>();
  frozen->keyframes_ = keyframes_.freeze();
  frozen->landmarks_ = landmarks_.freeze();
  frozen->covisibility_ = covisibility_.freeze();
  frozen->keyframe_forwarding_ = keyframe_forwarding_.freeze();
  frozen->landmark_forwarding_ = landmark_forwarding_.freeze();
  frozen->odometry_ = odometry_.freeze();
  frozen->submaps_ = submaps_;
  frozen->loop_edges_ = loop_edges_;
  frozen->markers_ = markers_;
  frozen->newest_frame_ = newest_frame_;
  last_frozen_ = frozen;
  return frozen;
}

Map Map::thaw(const Map& frozen) {
  Map map;
  map.keyframes_ = decltype(keyframes_)::thaw(frozen.keyframes_);
  map.landmarks_ = decltype(landmarks_)::thaw(frozen.landmarks_);
  map.covisibility_ = decltype(covisibility_)::thaw(frozen.covisibility_);
  map.keyframe_forwarding_ = decltype(keyframe_forwarding_)::thaw(frozen.keyframe_forwarding_);
  map.landmark_forwarding_ = decltype(landmark_forwarding_)::thaw(frozen.landmark_forwarding_);
  map.odometry_ = decltype(odometry_)::thaw(frozen.odometry_);
  map.submaps_ = frozen.submaps_;
  map.loop_edges_ = frozen.loop_edges_;
  map.markers_ = frozen.markers_;
  map.newest_frame_ = frozen.newest_frame_;
  map.freeze();  // Keeps references to what is edited first.
  return map;
}

LandmarkId Map::resolve(LandmarkId id) const {
  while (id.is_valid() && !landmarks_.find(id)) {
    const LandmarkForwarding* forwarding = landmark_forwarding_.find(id);
    id = forwarding ? forwarding->survivor : LandmarkId{};
  }
  return id;
}

KeyframeId Map::resolve(KeyframeId id) const {
  while (!keyframes_.find(id)) id = keyframe_forwarding_.at(id).heir;
  return id;
}

SubmapId Map::resolve(SubmapId id) const {
  while (submaps_.at(id.value).joined_into.is_valid()) id = submaps_[id.value].joined_into;
  return id;
}

std::vector<LoopEdge> Map::loop_edges() const {
  std::vector<LoopEdge> edges = loop_edges_;
  for (LoopEdge& edge : edges) {
    const double from_scale = keyframes_.at(edge.from).applied_scale;
    const double to_scale = keyframes_.at(edge.to).applied_scale;
    edge.to_from_from.translation *= to_scale;
    edge.to_from_from.scale *= to_scale / from_scale;
  }
  return edges;
}

bool Map::has_loop_edge(KeyframeId id) const {
  return std::any_of(loop_edges_.begin(), loop_edges_.end(), [&](const LoopEdge& edge) {
    return edge.from == id || edge.to == id;
  });
}

double Map::scale_since(KeyframeId reference, double scale_then) const {
  while (!keyframes_.find(reference)) {
    const KeyframeForwarding& forwarding = keyframe_forwarding_.at(reference);
    scale_then *= forwarding.heir_scale / forwarding.scale;
    reference = forwarding.heir;
  }
  return keyframes_.at(reference).applied_scale / scale_then;
}

Rigid3 Map::rig_from_world(KeyframeId reference,
                           const Rigid3& rig_from_keyframe,
                           double scale_then) const {
  const Keyframe* keyframe = keyframes_.find(reference);
  Rigid3 rig_from_reference = rig_from_keyframe;
  while (!keyframe) {
    const KeyframeForwarding& forwarding = keyframe_forwarding_.at(reference);
    rig_from_reference.translation *= forwarding.scale / scale_then;
    rig_from_reference = rig_from_reference * forwarding.rig_from_heir;
    scale_then = forwarding.heir_scale;
    reference = forwarding.heir;
    keyframe = keyframes_.find(reference);
  }
  rig_from_reference.translation *= keyframe->applied_scale / scale_then;
  return rig_from_reference * keyframe->rig_from_world;
}

SubmapId Map::add_submap(bool is_metric) {
  submaps_.push_back({is_metric, {}, {}});
  return SubmapId{static_cast<std::uint32_t>(submaps_.size() - 1)};
}

KeyframeId Map::add_keyframe(Keyframe keyframe) {
  WAYMARK_CHECK(keyframe.features && keyframe.features->rig &&
                keyframe.submap.value < submaps_.size());
  WAYMARK_CHECK(!keyframe.parent.is_valid() || keyframes_.find(keyframe.parent));
  keyframe.features = kept(std::move(keyframe.features));
  keyframe.landmarks.assign(keyframe.features->size(), LandmarkId{});
  Submap& submap = submaps_[keyframe.submap.value];
  const bool is_root = !submap.root.is_valid();
  WAYMARK_CHECK(is_root != keyframe.parent.is_valid());
  newest_frame_ = std::max(newest_frame_, keyframe.frame);
  const KeyframeId id = keyframes_.insert(std::move(keyframe));
  covisibility_.insert({});
  if (is_root) submap.root = id;
  constexpr std::uint32_t kPeriod = 64;
  if (id.value % kPeriod == 0) forget_old_merges();
  return id;
}

LandmarkId Map::add_landmark(SubmapId submap,
                             const Eigen::Vector3d& position_in_world,
                             KeyframeId reference) {
  return landmarks_.insert({submap, position_in_world, reference, {}, {}});
}

void Map::observe(KeyframeId keyframe, std::uint32_t feature, LandmarkId landmark) {
  WAYMARK_CHECK(!keyframes_.at(keyframe).landmarks.at(feature).is_valid());
  if (!is_observed_by(landmarks_.at(landmark), keyframe)) {
    for (KeyframeId other : observers_except(landmarks_.at(landmark), keyframe)) {
      change_covisibility(keyframe, other, 1);
    }
  }
  keyframes_.edit(keyframe).landmarks[feature] = landmark;
  Landmark& observed = landmarks_.edit(landmark);
  auto& observations = observed.observations;
  if (observations.empty()) observed.reference = keyframe;
  const Observation observation{keyframe, feature};
  observations.insert(std::lower_bound(observations.begin(), observations.end(), observation),
                      observation);
}

void Map::forget(KeyframeId keyframe, std::uint32_t feature) {
  const LandmarkId id = keyframes_.at(keyframe).landmarks.at(feature);
  WAYMARK_CHECK(id.is_valid());
  keyframes_.edit(keyframe).landmarks[feature] = LandmarkId{};
  Landmark& landmark = landmarks_.edit(id);
  std::erase(landmark.observations, Observation{keyframe, feature});
  if (is_observed_by(landmark, keyframe)) return;
  const std::vector<KeyframeId> others = observers_except(landmark, keyframe);
  if (landmark.reference == keyframe && !others.empty()) landmark.reference = others.front();
  for (KeyframeId other : others) change_covisibility(keyframe, other, -1);
}

void Map::merge_landmarks(LandmarkId survivor, LandmarkId absorbed) {
  WAYMARK_CHECK(survivor != absorbed);
  const Landmark old = landmarks_.at(absorbed);
  erase_landmark(absorbed);
  KeyframeId last_moved;
  for (const Observation& observation : old.observations) {
    const bool is_moving = observation.keyframe == last_moved;
    if (!is_moving && is_observed_by(landmarks_.at(survivor), observation.keyframe)) continue;
    observe(observation.keyframe, observation.feature, survivor);
    last_moved = observation.keyframe;
  }
  Landmark& merged = landmarks_.edit(survivor);
  merged.num_visible += old.num_visible;
  merged.num_found += old.num_found;
  landmark_forwarding_.put(absorbed, {survivor, newest_frame_});
}

void Map::erase_landmark(LandmarkId id) {
  const std::vector<Observation> observations = landmarks_.at(id).observations;
  for (const Observation& observation : observations) {
    forget(observation.keyframe, observation.feature);
  }
  landmarks_.erase(id);
}

void Map::erase_keyframe(KeyframeId id) {
  const Keyframe old = keyframes_.at(id);
  WAYMARK_CHECK(old.parent.is_valid() && !has_loop_edge(id));
  for (std::uint32_t feature = 0; feature < old.landmarks.size(); ++feature) {
    const LandmarkId landmark = old.landmarks[feature];
    if (!landmark.is_valid() || !landmarks_.find(landmark)) continue;
    forget(id, feature);
    if (landmarks_.at(landmark).observations.empty()) erase_landmark(landmark);
  }
  std::vector<KeyframeId> children;
  keyframes_.for_each([&](KeyframeId other, const Keyframe& keyframe) {
    if (keyframe.parent == id) children.push_back(other);
  });
  for (KeyframeId child : children) keyframes_.edit(child).parent = old.parent;
  const Keyframe& heir = keyframes_.at(old.parent);
  keyframe_forwarding_.put(id,
                           {old.parent,
                            old.rig_from_world * heir.rig_from_world.inverse(),
                            heir.applied_scale,
                            old.applied_scale});
  keyframes_.erase(id);
  covisibility_.erase(id);
}

void Map::move_keyframe(KeyframeId id, const Rigid3& rig_from_world) {
  keyframes_.edit(id).rig_from_world = rig_from_world;
}

void Map::recompute_keyframe(KeyframeId id, std::shared_ptr<const Features> features) {
  WAYMARK_CHECK(features && features->rig);
  WAYMARK_CHECK(features->size() == keyframes_.at(id).features->size());
  keyframes_.edit(id).features = kept(std::move(features));
}

std::shared_ptr<const Features> Map::kept(std::shared_ptr<const Features> features) const {
  return feature_memory_ ? stored_in(feature_memory_, *features) : std::move(features);
}

void Map::rescale_keyframe(KeyframeId id, double factor) {
  WAYMARK_CHECK(factor > 0.0);
  keyframes_.edit(id).applied_scale *= factor;
}

void Map::add_loop_edge(const LoopEdge& edge) {
  WAYMARK_CHECK(edge.from != edge.to);
  const double from_scale = keyframes_.at(edge.from).applied_scale;
  const double to_scale = keyframes_.at(edge.to).applied_scale;
  LoopEdge stored = edge;
  stored.to_from_from.translation /= to_scale;
  stored.to_from_from.scale *= from_scale / to_scale;
  loop_edges_.push_back(stored);
}

void Map::drop_loop_edges(std::span<const std::uint8_t> is_kept) {
  WAYMARK_CHECK(is_kept.size() == loop_edges_.size());
  std::size_t index = 0;
  std::erase_if(loop_edges_, [&](const LoopEdge&) { return is_kept[index++] == 0; });
}

void Map::join_submaps(KeyframeId child, KeyframeId parent) {
  const SubmapId from = keyframes_.at(child).submap;
  const SubmapId into = keyframes_.at(parent).submap;
  WAYMARK_CHECK(from != into && submaps_[from.value].is_metric == submaps_[into.value].is_metric);
  KeyframeId above = parent;
  for (KeyframeId id = child; id.is_valid();) {
    const KeyframeId old_parent = std::exchange(keyframes_.edit(id).parent, above);
    above = std::exchange(id, old_parent);
  }
  std::vector<KeyframeId> keyframes;
  keyframes_.for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap == from) keyframes.push_back(id);
  });
  std::vector<LandmarkId> landmarks;
  landmarks_.for_each([&](LandmarkId id, const Landmark& landmark) {
    if (landmark.submap == from) landmarks.push_back(id);
  });
  for (KeyframeId id : keyframes) keyframes_.edit(id).submap = into;
  for (LandmarkId id : landmarks) landmarks_.edit(id).submap = into;
  submaps_[from.value].root = KeyframeId{};
  submaps_[from.value].joined_into = into;
}

void Map::move_landmark(LandmarkId id, const Eigen::Vector3d& position_in_world) {
  landmarks_.edit(id).position_in_world = position_in_world;
}

void Map::set_appearance(LandmarkId id, const Appearance& appearance) {
  landmarks_.edit(id).appearance = appearance;
}

void Map::count_visibility(LandmarkId id, std::uint32_t num_visible, std::uint32_t num_found) {
  Landmark& landmark = landmarks_.edit(id);
  landmark.num_visible += num_visible;
  landmark.num_found += num_found;
}

void Map::forget_old_merges() {
  std::vector<LandmarkId> old;
  landmark_forwarding_.for_each([&](LandmarkId id, const LandmarkForwarding& forwarding) {
    if (newest_frame_.value - forwarding.frame.value > kRemembersMerged) old.push_back(id);
  });
  for (const LandmarkId id : old) landmark_forwarding_.erase(id);
}

void Map::change_covisibility(KeyframeId a, KeyframeId b, int change) {
  for (int side = 0; side < 2; ++side, std::swap(a, b)) {
    auto& edges = covisibility_.edit(a).edges;
    const auto at = std::ranges::lower_bound(edges, b, {}, &CovisibilityEdge::keyframe);
    if (at == edges.end() || at->keyframe != b) {
      WAYMARK_CHECK(change > 0);
      edges.insert(at, CovisibilityEdge{b, static_cast<std::uint32_t>(change)});
    } else {
      at->num_shared += static_cast<std::uint32_t>(change);
      if (at->num_shared == 0) edges.erase(at);
    }
  }
}

}  // namespace waymark
