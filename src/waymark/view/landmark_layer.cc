// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/landmark_layer.h"

#include <algorithm>

namespace waymark {
namespace {

/// A frame may become a keyframe long after it came: the first one of a monocular start.
constexpr std::uint32_t kMaxFrames = 1000;

bool is_same_place(const Landmark& a, const Landmark& b) {
  return a.position_in_world.cast<float>() == b.position_in_world.cast<float>();
}

bool is_same_otherwise(const Landmark& a, const Landmark& b) {
  return a.submap == b.submap && a.reference == b.reference &&
         saturate16(num_observers(a)) == saturate16(num_observers(b));
}

Message encode_positions(const Map& map, std::span<const LandmarkId> ids) {
  MessageWriter writer(MessageKind::kLandmarkPositions, ids.size());
  for (const LandmarkId id : ids) writer.add(id.value);
  for (const LandmarkId id : ids) writer.add(map.landmarks().at(id).position_in_world);
  return writer.finish();
}

/// The frame of the keyframe that a landmark was made from, or of what stands for it.
std::uint32_t frame_of(const Map& map, const Landmark& landmark) {
  const Keyframe* keyframe = map.keyframes().find(map.resolve(landmark.reference));
  return keyframe ? keyframe->frame.value : FrameId{}.value;
}

}  // namespace

void LandmarkLayer::add_colors(FeatureColors colors) {
  const std::uint32_t frame = colors.frame.value;
  if (frame >= kMaxFrames) colors_of_frames_.erase(frame - kMaxFrames);
  colors_of_frames_.insert_or_assign(frame, std::move(colors));
}

void LandmarkLayer::color_landmarks(const Map& before, const Map& after) {
  colors_.resize(after.landmarks().end_id().value);
  after.landmarks().for_each_difference(
      before.landmarks(), [&](LandmarkId id, const Landmark* old, const Landmark* now) {
        if (old || !now) return;
        for (const Observation& observation : now->observations) {
          const Keyframe& keyframe = after.keyframes().at(observation.keyframe);
          const auto found = colors_of_frames_.find(keyframe.frame.value);
          if (found == colors_of_frames_.end()) continue;
          const auto& rgb = found->second.rgb;
          if (observation.feature >= rgb.size()) continue;
          colors_[id.value] = {rgb[observation.feature], 1};
          return;
        }
      });
}

void LandmarkLayer::reset() {
  colors_of_frames_.clear();
  colors_.clear();
}

void LandmarkLayer::differences(const Map& before,
                                const Map& after,
                                std::vector<Message>& messages) const {
  std::vector<LandmarkId> changed;
  std::vector<LandmarkId> moved;
  std::vector<std::uint32_t> erased;
  after.landmarks().for_each_difference(
      before.landmarks(), [&](LandmarkId id, const Landmark* old, const Landmark* now) {
        if (!now) {
          erased.push_back(id.value);
        } else if (!old || !is_same_otherwise(*old, *now)) {
          changed.push_back(id);
        } else if (!is_same_place(*old, *now)) {
          moved.push_back(id);
        }
      });
  for_each_chunk<std::uint32_t>(erased, [&](auto ids) {
    messages.push_back(encode_ids(MessageKind::kLandmarksErased, ids));
  });
  for_each_chunk<LandmarkId>(changed, [&](auto ids) { messages.push_back(encode(after, ids)); });
  for_each_chunk<LandmarkId>(moved,
                             [&](auto ids) { messages.push_back(encode_positions(after, ids)); });
}

void LandmarkLayer::snapshot(const Map& map, std::vector<Message>& messages) const {
  std::vector<LandmarkId> all;
  all.reserve(map.landmarks().size());
  map.landmarks().for_each([&](LandmarkId id, const Landmark&) { all.push_back(id); });
  for_each_chunk<LandmarkId>(all, [&](auto ids) { messages.push_back(encode(map, ids)); });
}

Message LandmarkLayer::encode(const Map& map, std::span<const LandmarkId> ids) const {
  const auto& landmarks = map.landmarks();
  MessageWriter writer(MessageKind::kLandmarks, ids.size());
  for (const LandmarkId id : ids) writer.add(id.value);
  for (const LandmarkId id : ids) writer.add(landmarks.at(id).position_in_world);
  for (const LandmarkId id : ids) writer.add(frame_of(map, landmarks.at(id)));
  for (const LandmarkId id : ids) writer.add(saturate16(num_observers(landmarks.at(id))));
  for (const LandmarkId id : ids) writer.add(saturate16(landmarks.at(id).submap.value));
  for (const LandmarkId id : ids) {
    const Color color = id.value < colors_.size() ? colors_[id.value] : Color{};
    for (const std::uint8_t value : color.rgb) writer.add(value);
    writer.add(static_cast<std::uint8_t>(color.is_known ? 255 : 0));
  }
  return writer.finish();
}

}  // namespace waymark
