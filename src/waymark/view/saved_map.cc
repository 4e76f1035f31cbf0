// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/saved_map.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "waymark/input/decode.h"

namespace waymark {
namespace {

/// The keyframes stand for the trajectory.
std::vector<FrameSummary> note_keyframes(const Map& map) {
  std::vector<FrameSummary> notes;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    FrameSummary note;
    note.frame = keyframe.frame;
    note.timestamp_ns = keyframe.timestamp_ns;
    note.state = FrameState::kTracked;
    note.final_pose = keyframe.rig_from_world.inverse();
    note.submap = keyframe.submap;
    notes.push_back(note);
  });
  std::sort(notes.begin(), notes.end(), [](const FrameSummary& a, const FrameSummary& b) {
    return a.frame < b.frame;
  });
  return notes;
}

std::vector<FeatureColors> sample_images(const StoredMap& stored) {
  std::vector<FeatureColors> colors;
  for (const auto& [id, bytes] : stored.images) {
    const Keyframe* keyframe = stored.map->keyframes().find(id);
    const std::optional<ColorImage> image = decode_color_image(*bytes);
    if (!keyframe || !image) continue;
    FeatureColors& found = colors.emplace_back();
    found.frame = keyframe->frame;
    for (std::size_t i = 0; i < keyframe->features->num_primary; ++i) {
      const Keypoint& keypoint = keyframe->features->keypoints[i];
      const int x = std::clamp(static_cast<int>(keypoint.x_px + 0.5f), 0, image->width_px - 1);
      const int y = std::clamp(static_cast<int>(keypoint.y_px + 0.5f), 0, image->height_px - 1);
      found.rgb.push_back(image->row(y)[x]);
    }
  }
  return colors;
}

}  // namespace

ViewUpdate show_saved_map(const StoredMap& stored) {
  ViewUpdate update;
  update.map = stored.map;
  update.frames = note_keyframes(*stored.map);
  update.colors = sample_images(stored);
  update.keyframe_images = stored.images;
  SessionStatus& status = update.status;
  status.phase = SessionPhase::kMap;
  status.is_mapping = false;
  status.num_frames = status.num_tracked = update.frames.size();
  return update;
}

}  // namespace waymark
