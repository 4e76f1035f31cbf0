// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/map/map.h"
#include "waymark/map/parts.h"

namespace waymark {

inline Descriptor random_descriptor(Rng& rng) {
  return {rng.next(), rng.next(), rng.next(), rng.next()};
}

/// Each keyframe's own features, as if all of it had been seen.
inline void copy_features(MapParts& parts, std::size_t num_recognised, Rng& rng) {
  for (std::size_t i = 0; i < parts.keyframes.size(); ++i) {
    Keyframe& keyframe = parts.keyframes[i].keyframe;
    auto features = std::make_shared<Features>(*keyframe.features);
    if (i >= num_recognised) {
      for (Descriptor& descriptor : features->descriptors) descriptor = random_descriptor(rng);
    }
    keyframe.features = std::move(features);
  }
}

/// A large map from a small one: it again and again, as further sub-maps, until there are so many
/// keyframes. The copies have random descriptors, so that nothing is recognised there.
inline std::shared_ptr<const Map> repeat_map(const Map& map, std::size_t num_keyframes) {
  Rng rng(0, 0);
  MapParts parts;
  while (parts.keyframes.size() < num_keyframes) append_parts(map, parts);
  copy_features(parts, map.keyframes().size(), rng);
  for (std::size_t i = map.landmarks().size(); i < parts.landmarks.size(); ++i) {
    parts.landmarks[i].landmark.appearance.descriptor = random_descriptor(rng);
  }
  return Map::restore(std::move(parts)).freeze();
}

/// The last keyframes of a map once more, as if the camera had stood there again.
inline void repeat_last_keyframes(Map& map, std::uint32_t count) {
  std::vector<KeyframeId> last;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { last.push_back(id); });
  if (last.size() > count) last.erase(last.begin(), last.end() - count);
  std::uint32_t frame = 0;
  for (const KeyframeId id : last) frame = std::max(frame, map.keyframes().at(id).frame.value);
  for (const KeyframeId before : last) {
    Keyframe keyframe = map.keyframes().at(before);
    keyframe.frame = FrameId{++frame};
    keyframe.parent = before;
    const std::vector<LandmarkId> landmarks = std::exchange(keyframe.landmarks, {});
    const KeyframeId id = map.add_keyframe(std::move(keyframe));
    for (std::uint32_t f = 0; f < landmarks.size(); ++f) {
      if (landmarks[f].is_valid()) map.observe(id, f, landmarks[f]);
    }
  }
}

}  // namespace waymark
