// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Images are found in a map that stays as it is.
//
//   Localizer localizer(rig, settings, load_map("house.wmap").map);
//   const TrackingResult alone = localizer.locate(images);
//   const TrackingResult next = localizer.track(images);  // of a stream: near the one before
//   if (next.world_from_rig) std::cout << next.world_from_rig->translation.transpose() << "\n";

#include <memory>
#include <optional>
#include <vector>

#include "waymark/camera/calibration.h"
#include "waymark/camera/rig.h"
#include "waymark/map/map.h"
#include "waymark/system/settings.h"
#include "waymark/system/system.h"

namespace waymark {

/// About where an image was taken, in the frame of a sub-map.
struct PosePrior {
  Rigid3 world_from_rig;  ///< About; what keyframes near it show is looked for first.
  SubmapId submap{0};     ///< Whose frame it is in.
};

/// Finds images in a map that stays as it is. The camera may be of another model, size and lens
/// than those the map was made with. Poses are in the map's frame. Ranges of stereo and depth count
/// only in maps with a scale in metres.
///
/// A calibration that does not fit is mended unless the settings say otherwise: frames that were
/// located are looked at together (10, 20 and 40 images by themselves, or every fifth of a stream),
/// and where they contradict it, later ones are located with what they tell.
///
/// A result without a pose tells how far the search got: how many places were compared
/// (num_candidates), and of the one that came closest the matches, the inliers and why it was
/// refused (reason). One thread at a time.
class Localizer {
 public:
  /// Throws InputError for a rig or settings that cannot work together.
  Localizer(Rig rig, const Settings& settings, std::shared_ptr<const Map> map);
  ~Localizer();
  Localizer(const Localizer&) = delete;
  Localizer& operator=(const Localizer&) = delete;

  /// The map that was given.
  const Map& map() const;
  /// The rig as calibrated by now, of the images as they are given.
  Rig rig() const;
  /// What the images told of each number of the calibration; empty where they have not changed it.
  std::vector<CalibrationEstimate> calibration() const;

  /// The next image of a stream: looked for near the one before, and anywhere where it is not.
  /// Where the map shows too little, for two seconds at most, landmarks that the stream itself saw
  /// make up for it.
  TrackingResult track(const FrameImages& images);

  /// An image by itself: looked for near the hint, if there is one, and anywhere where it is not.
  /// Leaves the stream alone.
  TrackingResult locate(const FrameImages& images, const std::optional<PosePrior>& hint = {});

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
