// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/keyframe_image_cache.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "waymark/session/frame_pipeline.h"

namespace waymark {
namespace {

// A start may make keyframes of frames that long ago, a new keyframe takes some frames to show in
// the map, and frames are read some time before they are fed.
constexpr std::size_t kNumYoung = 100 + kMaxPrepared;

}  // namespace

KeyframeImageCache::KeyframeImageCache(NewestMap newest_map, KeyframeImages earlier)
    : newest_map_(std::move(newest_map)),
      earlier_(std::move(earlier)),
      first_new_(newest_map_()->keyframes().end_id()) {}

void KeyframeImageCache::add(InputFrame& frame) {
  if (frame.jpeg.empty()) return;
  images_[frame.timestamp_ns] = std::make_shared<const std::string>(std::move(frame.jpeg));
  frame.jpeg.clear();
  if (images_.size() >= num_at_last_check_ + kNumYoung) forget_others();
}

void KeyframeImageCache::begin_anew() {
  earlier_.clear();
  first_new_ = KeyframeId{0};
}

/// Only frames that are old enough can be told not to be keyframes.
void KeyframeImageCache::forget_others() {
  std::set<std::int64_t> kept;
  newest_map_()->keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { kept.insert(keyframe.timestamp_ns); });
  const auto young = std::prev(images_.end(), static_cast<std::ptrdiff_t>(kNumYoung));
  for (auto image = images_.begin(); image != young;) {
    image = kept.contains(image->first) ? std::next(image) : images_.erase(image);
  }
  num_at_last_check_ = images_.size();
}

SharedJpeg KeyframeImageCache::image_of(KeyframeId id, const Keyframe& keyframe) const {
  if (id < first_new_) {
    const auto image = earlier_.find(id);
    return image == earlier_.end() ? nullptr : image->second;
  }
  const auto image = images_.find(keyframe.timestamp_ns);
  return image == images_.end() ? nullptr : image->second;
}

KeyframeImages KeyframeImageCache::images_of(const Map& map) const {
  KeyframeImages result;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (SharedJpeg image = image_of(id, keyframe)) result.emplace(id, std::move(image));
  });
  return result;
}

}  // namespace waymark
