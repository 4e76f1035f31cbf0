// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/camera/rig.h"
#include "waymark/image/image.h"
#include "waymark/map/map.h"
#include "waymark/map/messages.h"
#include "waymark/mapping/markers.h"
#include "waymark/marker/detect.h"
#include "waymark/marker/settings.h"
#include "waymark/system/system.h"
#include "waymark/track/frame.h"
#include "waymark/track/tracking_result.h"

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

  /// What a survey found of what is looked for; empty where nothing is.
  MarkerReport report(const MarkerSurvey& survey) const {
    return is_on() ? MarkerReport{family(), survey.markers, survey.frame} : MarkerReport{};
  }

  /// A search in the images of a frame, those of a pair both, done once when it is called first;
  /// the images must be there then. Empty where nothing is looked for.
  std::function<MarkerObservations()> search_in(const FrameImages& images,
                                                std::shared_ptr<const Rig> rig) const;

  /// Notes with a keyframe the markers that its frame shows: those that can be read, and those of
  /// the map that are seen where they should be. result: of the frame.
  void add_markers(const Frame& frame,
                   const FrameImages& images,
                   const Rig& rig,
                   const Map& map,
                   const TrackingResult& result,
                   MapperMessage& message) const;

 private:
  MarkerObservations confirm(const FrameImages& images,
                             const Rig& rig,
                             const Map& map,
                             const TrackingResult& result,
                             const MarkerObservations& read) const;

  std::optional<MarkerDetector> detector_;
};

}  // namespace waymark
