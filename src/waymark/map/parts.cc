// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/parts.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/camera/rig.h"

namespace waymark {
namespace {

/// What is added to the ids of a map that comes behind others.
struct Shift {
  std::uint32_t keyframe = 0;
  std::uint32_t landmark = 0;
  std::uint32_t submap = 0;
  std::uint32_t frame = 0;

  KeyframeId operator()(KeyframeId id) const { return shifted(id, keyframe); }
  LandmarkId operator()(LandmarkId id) const { return shifted(id, landmark); }
  SubmapId operator()(SubmapId id) const { return shifted(id, submap); }
  FrameId operator()(FrameId id) const { return shifted(id, frame); }

 private:
  template <class IdType>
  static IdType shifted(IdType id, std::uint32_t by) {
    return id.is_valid() ? IdType{id.value + by} : id;
  }
};

Shift shift_behind(const MapParts& parts) {
  Shift shift;
  shift.keyframe = parts.end_keyframe.is_valid() ? parts.end_keyframe.value : 0;
  shift.landmark = parts.end_landmark.is_valid() ? parts.end_landmark.value : 0;
  shift.submap = static_cast<std::uint32_t>(parts.submaps.size());
  for (const MapParts::StoredKeyframe& stored : parts.keyframes) {
    shift.frame = std::max(shift.frame, stored.keyframe.frame.value + 1);
  }
  return shift;
}

/// Rigs by what they are: those of two files that are the same become one.
class RigPool {
 public:
  explicit RigPool(const MapParts& parts) {
    for (const MapParts::StoredKeyframe& stored : parts.keyframes)
      share(stored.keyframe.features->rig);
  }

  std::shared_ptr<const Rig> share(const std::shared_ptr<const Rig>& rig) {
    for (const std::shared_ptr<const Rig>& known : rigs_) {
      if (is_same_rig(*known, *rig)) return known;
    }
    rigs_.push_back(rig);
    return rig;
  }

 private:
  std::vector<std::shared_ptr<const Rig>> rigs_;
};

void append_submaps(const Map& map, const Shift& shift, MapParts& parts) {
  for (Submap submap : map.submaps()) {
    submap.root = shift(submap.root);
    submap.joined_into = shift(submap.joined_into);
    parts.submaps.push_back(submap);
  }
  for (LoopEdge edge : map.measured_loop_edges()) {
    edge.from = shift(edge.from);
    edge.to = shift(edge.to);
    parts.loop_edges.push_back(edge);
  }
  for (MapMarker marker : map.markers()) {
    marker.reference = shift(marker.reference);
    parts.markers.push_back(marker);
  }
  std::ranges::stable_sort(parts.markers, {}, &MapMarker::id);
}

void append_keyframes(const Map& map, const Shift& shift, MapParts& parts) {
  RigPool rigs(parts);
  map.keyframes().for_each([&](KeyframeId id, Keyframe keyframe) {
    keyframe.frame = shift(keyframe.frame);
    keyframe.submap = shift(keyframe.submap);
    keyframe.parent = shift(keyframe.parent);
    if (auto rig = rigs.share(keyframe.features->rig); rig != keyframe.features->rig) {
      auto features = std::make_shared<Features>(*keyframe.features);
      features->rig = std::move(rig);
      keyframe.features = std::move(features);
    }
    for (LandmarkId& landmark : keyframe.landmarks) landmark = shift(landmark);
    parts.keyframes.push_back({shift(id), std::move(keyframe)});
  });
  map.keyframe_forwarding().for_each([&](KeyframeId id, KeyframeForwarding forwarding) {
    forwarding.heir = shift(forwarding.heir);
    parts.erased_keyframes.push_back({shift(id), forwarding});
  });
  map.odometry().for_each([&](KeyframeId id, OdometryNode node) {
    node.parent = shift(node.parent);
    parts.odometry.push_back({shift(id), node});
  });
}

void append_landmarks(const Map& map, const Shift& shift, MapParts& parts) {
  map.landmarks().for_each([&](LandmarkId id, Landmark landmark) {
    landmark.submap = shift(landmark.submap);
    landmark.reference = shift(landmark.reference);
    landmark.observations.clear();
    parts.landmarks.push_back({shift(id), std::move(landmark)});
  });
  map.landmark_forwarding().for_each([&](LandmarkId id, const LandmarkForwarding& forwarding) {
    parts.merged_landmarks.push_back({shift(id), shift(forwarding.survivor)});
  });
}

}  // namespace

void append_parts(const Map& map, MapParts& parts) {
  const Shift shift = shift_behind(parts);
  append_submaps(map, shift, parts);
  append_keyframes(map, shift, parts);
  append_landmarks(map, shift, parts);
  parts.end_keyframe = shift(map.keyframes().end_id());
  parts.end_landmark = shift(map.landmarks().end_id());
}

MapParts take_apart(const Map& map) {
  MapParts parts;
  append_parts(map, parts);
  return parts;
}

Map Map::restore(MapParts parts) {
  Map map;
  map.submaps_ = std::move(parts.submaps);
  map.loop_edges_ = std::move(parts.loop_edges);
  map.markers_ = std::move(parts.markers);
  for (MapParts::StoredLandmark& stored : parts.landmarks) {
    map.landmarks_.put(stored.id, std::move(stored.landmark));
  }
  map.landmarks_.skip_to(parts.end_landmark);
  for (MapParts::StoredKeyframe& stored : parts.keyframes) {
    Keyframe& keyframe = stored.keyframe;
    WAYMARK_CHECK(keyframe.features && keyframe.features->rig);
    for (std::uint32_t feature = 0; feature < keyframe.landmarks.size(); ++feature) {
      const LandmarkId landmark = keyframe.landmarks[feature];
      if (!map.landmarks_.contains(landmark)) continue;
      map.landmarks_.edit(landmark).observations.push_back({stored.id, feature});
    }
    map.newest_frame_ = std::max(map.newest_frame_, keyframe.frame);
    map.keyframes_.put(stored.id, std::move(keyframe));
  }
  map.keyframes_.skip_to(parts.end_keyframe);
  for (const MapParts::ErasedKeyframe& erased : parts.erased_keyframes) {
    map.keyframe_forwarding_.put(erased.id, erased.forwarding);
  }
  for (const MapParts::StoredOdometry& noted : parts.odometry) {
    map.odometry_.put(noted.id, noted.node);
  }
  for (const MapParts::MergedLandmark& merged : parts.merged_landmarks) {
    map.landmark_forwarding_.put(merged.id, {merged.survivor, map.newest_frame_});
  }
  map.covisibility_ = map.count_covisibility();
  return map;
}

Map unite(const Map& a, const Map& b) {
  MapParts parts = take_apart(a);
  append_parts(b, parts);
  return Map::restore(std::move(parts));
}

}  // namespace waymark
