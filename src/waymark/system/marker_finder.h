// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/camera/rig.h"
#include "waymark/image/image.h"
#include "waymark/marker/detect.h"
#include "waymark/marker/settings.h"
#include "waymark/track/frame.h"
#include "waymark/track/messages.h"

namespace waymark {

/// Finds the markers that the settings ask for, in the frames that somebody asks it for.
class MarkerFinder {
 public:
  /// Throws InputError for settings that ask for nothing there is.
  explicit MarkerFinder(const MarkerSettings& settings);

  /// Whether there is something to look for.
  bool is_on() const { return detector_.has_value(); }
  /// Name of the family that is looked for; empty: none.
  std::string family() const { return detector_ ? detector_->family().name() : ""; }

  /// A search in image 0 of a frame, done once when it is called first; the images must be there
  /// then. Empty where nothing is looked for.
  std::function<MarkerSightings()> search_in(const FrameImages& images,
                                             std::shared_ptr<const Rig> rig) const;

 private:
  std::optional<MarkerDetector> detector_;
};

/// Notes the markers that a frame shows with the keyframe that is made of it.
void add_markers(const Frame& frame, MapperMessage& message);

}  // namespace waymark
