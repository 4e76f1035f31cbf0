// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "waymark/base/check.h"
#include "waymark/map/covisibility.h"
#include "waymark/map/map.h"

namespace waymark {
namespace {

template <class Id, class T>
void put(CowTable<Id, T>& table, Id id, T value) {
  table.skip_to(id);
  table.insert(std::move(value));
}

}  // namespace

Map Map::restore(MapParts parts) {
  Map map;
  map.submaps_ = std::move(parts.submaps);
  map.loop_edges_ = std::move(parts.loop_edges);
  for (MapParts::StoredLandmark& stored : parts.landmarks) {
    put(map.landmarks_, stored.id, std::move(stored.landmark));
  }
  map.landmarks_.skip_to(parts.end_landmark);
  // One entry for each that lives or was merged, in order.
  auto merged = parts.merged_landmarks.begin();
  const auto put_merged_before = [&](LandmarkId end) {
    for (; merged != parts.merged_landmarks.end() && merged->id < end; ++merged) {
      put(map.landmark_forwarding_, merged->id, merged->survivor);
    }
  };
  map.landmarks_.for_each([&](LandmarkId id, const Landmark&) {
    put_merged_before(id);
    put(map.landmark_forwarding_, id, LandmarkId{});
  });
  put_merged_before(parts.end_landmark);
  map.landmark_forwarding_.skip_to(parts.end_landmark);

  auto erased = parts.erased_keyframes.begin();
  const auto put_erased_before = [&](KeyframeId end) {
    for (; erased != parts.erased_keyframes.end() && erased->id < end; ++erased) {
      put(map.keyframe_forwarding_, erased->id, erased->forwarding);
    }
  };
  for (MapParts::StoredKeyframe& stored : parts.keyframes) {
    Keyframe& keyframe = stored.keyframe;
    WAYMARK_CHECK(keyframe.features && keyframe.rig);
    for (std::uint32_t feature = 0; feature < keyframe.landmarks.size(); ++feature) {
      const LandmarkId landmark = keyframe.landmarks[feature];
      if (!map.landmarks_.contains(landmark)) continue;
      map.landmarks_.edit(landmark).observations.push_back({stored.id, feature});
    }
    put_erased_before(stored.id);
    put(map.keyframe_forwarding_, stored.id, KeyframeForwarding{});
    put(map.keyframes_, stored.id, std::move(keyframe));
  }
  put_erased_before(parts.end_keyframe);
  map.keyframe_forwarding_.skip_to(parts.end_keyframe);
  map.keyframes_.skip_to(parts.end_keyframe);

  CovisibilityCounter counter(map.keyframes_, map.landmarks_);
  map.keyframes_.for_each([&](KeyframeId id, const Keyframe& keyframe) {
    put(map.covisibility_, id, counter.count(id, keyframe));
  });
  map.covisibility_.skip_to(parts.end_keyframe);
  return map;
}

}  // namespace waymark
