// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>

#include "waymark/input/input.h"
#include "waymark/map/map.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {

/// Remembers the images of frames that became keyframes or still may.
class KeyframeImageCache {
 public:
  using NewestMap = std::function<std::shared_ptr<const Map>()>;

  /// Keyframes that the newest map has already are those of earlier sessions, whose images are
  /// given.
  KeyframeImageCache(NewestMap newest_map, KeyframeImages earlier);

  /// Takes the JPEG file that a frame comes with.
  void add(InputFrame& frame);

  /// From now on there are no earlier sessions: the map was emptied.
  void begin_anew();

  /// That of a keyframe of this session; null where it was not kept.
  SharedJpeg image_of(KeyframeId id, const Keyframe& keyframe) const;

  /// Images of the keyframes of a map of this session.
  KeyframeImages images_of(const Map& map) const;

 private:
  void forget_others();

  const NewestMap newest_map_;
  KeyframeImages earlier_;
  KeyframeId first_new_;
  std::map<std::int64_t, SharedJpeg> images_;  // By time.
  std::size_t num_at_last_check_ = 0;
};

}  // namespace waymark
