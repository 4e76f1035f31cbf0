// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Images are found in an atlas.
//
//   AtlasLocalizer localizer(rig, settings, Atlas::open("building.atlas"));
//   const TrackingResult result = localizer.locate(images);
//   if (result.world_from_rig) std::cout << result.world_from_rig->translation.transpose() << "\n";

#include <cstddef>
#include <memory>
#include <optional>

#include "waymark/atlas/atlas.h"
#include "waymark/camera/rig.h"
#include "waymark/system/localizer.h"
#include "waymark/system/settings.h"
#include "waymark/system/system.h"

namespace waymark {

/// Tiles that an AtlasLocalizer keeps in memory, unless stated otherwise.
inline constexpr std::size_t kMaxOpenTiles = 16;

/// Finds images in an atlas as Localizer does in a map, and opens of it only what it needs: the
/// place index of all tiles, and the tiles that an image looks like. Poses are in the frame of the
/// part of the atlas that `submap` of the result names. What it says of an image by itself depends
/// on the image and the atlas, not on which tiles were opened before. The calibration is taken as
/// it is stated, and markers are not looked for. One thread at a time.
class AtlasLocalizer {
 public:
  /// Throws InputError for a rig or settings that cannot work together, and for damaged files. So
  /// do the others, where a tile is damaged.
  AtlasLocalizer(Rig rig,
                 const Settings& settings,
                 Atlas atlas,
                 std::size_t max_open_tiles = kMaxOpenTiles);
  ~AtlasLocalizer();
  AtlasLocalizer(const AtlasLocalizer&) = delete;
  AtlasLocalizer& operator=(const AtlasLocalizer&) = delete;

  /// The atlas that was given.
  const Atlas& atlas() const;

  /// The next image of a stream: looked for near the one before, then in all of the atlas.
  TrackingResult track(const FrameImages& images);

  /// An image by itself: looked for near the hint, if there is one (its sub-map is a part of the
  /// atlas), and anywhere where it is not. Leaves the stream alone.
  TrackingResult locate(const FrameImages& images, const std::optional<PosePrior>& hint = {});

  /// How often a tile was read from its file, and how many were.
  std::size_t num_opened() const;
  std::size_t num_tiles_seen() const;  ///< Each once.

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
