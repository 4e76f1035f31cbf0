// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/marker_finder.h"

#include <utility>
#include <variant>

#include "waymark/marker/known_markers.h"

namespace waymark {

MarkerFinder::MarkerFinder(const MarkerSettings& settings) {
  const auto markers = markers_to_look_for(settings);
  if (markers) detector_.emplace(MarkerFamily(markers->family, "markers.family"));
}

std::function<MarkerSightings()> MarkerFinder::search_in(const FrameImages& images,
                                                         std::shared_ptr<const Rig> rig) const {
  if (!detector_) return nullptr;
  auto found = std::make_shared<std::optional<MarkerSightings>>();
  return [this, found, image = images.image0, rig = std::move(rig)] {
    if (!*found) *found = detector_->detect(image, *rig->cameras[0].camera, 0);
    return **found;
  };
}

void add_markers(const Frame& frame, MapperMessage& message) {
  MarkerSightings found = frame.find_markers();
  if (found.empty()) return;
  auto markers = std::make_shared<const MarkerSightings>(std::move(found));
  if (auto* keyframe = std::get_if<NewKeyframe>(&message)) {
    keyframe->markers = std::move(markers);
    return;
  }
  for (InitialKeyframe& initial : std::get<NewSubmap>(message).keyframes) {
    if (initial.frame == frame.id) initial.markers = markers;
  }
}

}  // namespace waymark
