// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/marker_finder.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/marker/known_markers.h"

namespace waymark {
namespace {

/// The images that the cameras of a rig took, in their order; of a pair both.
std::vector<ImageView> views_of(const FrameImages& images, const Rig& rig) {
  std::vector<ImageView> views = {images.image0};
  if (rig.cameras.size() > 1 && !images.image1.is_empty()) views.push_back(images.image1);
  return views;
}

}  // namespace

MarkerFinder::MarkerFinder(const MarkerSettings& settings) {
  const auto markers = markers_to_look_for(settings);
  if (markers) detector_.emplace(MarkerFamily(markers->family, "markers.family"));
}

std::function<MarkerObservations()> MarkerFinder::search_in(const FrameImages& images,
                                                            std::shared_ptr<const Rig> rig) const {
  if (!detector_) return nullptr;
  auto found = std::make_shared<std::optional<MarkerObservations>>();
  return [this, found, views = views_of(images, *rig), rig] {
    if (*found) return **found;
    found->emplace();
    for (std::size_t i = 0; i < views.size(); ++i) {
      const MarkerObservations seen =
          detector_->detect(views[i], *rig->cameras[i].camera, static_cast<std::uint8_t>(i));
      (*found)->insert((*found)->end(), seen.begin(), seen.end());
    }
    std::ranges::stable_sort(**found, {}, &MarkerObservation::id);
    return **found;
  };
}

MarkerObservations MarkerFinder::confirm(const FrameImages& images,
                                         const Rig& rig,
                                         const Map& map,
                                         const TrackingResult& result,
                                         const MarkerObservations& read) const {
  const Rigid3 rig_from_world = result.world_from_rig->inverse();
  MarkerObservations all = read;
  const std::vector<ImageView> views = views_of(images, rig);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto camera = static_cast<std::uint8_t>(i);
    std::vector<ExpectedMarker> expected;
    for (const MapMarker& marker : map.markers()) {
      const bool is_read = std::ranges::any_of(read, [&](const MarkerObservation& observation) {
        return observation.id == marker.id && observation.camera == camera;
      });
      if (is_read || map.submap_of(marker) != result.submap) continue;
      const Rigid3 cam_from_world = rig.cameras[i].cam_from_rig * rig_from_world;
      expected.push_back(
          {marker.id, marker.side_m, cam_from_world * map.world_from_marker(marker)});
    }
    const MarkerObservations found =
        detector_->confirm(views[i], *rig.cameras[i].camera, camera, expected);
    all.insert(all.end(), found.begin(), found.end());
  }
  std::ranges::stable_sort(all, {}, &MarkerObservation::id);
  return all;
}

void MarkerFinder::add_markers(const Frame& frame,
                               const FrameImages& images,
                               const Rig& rig,
                               const Map& map,
                               const TrackingResult& result,
                               MapperMessage& message) const {
  MarkerObservations found = frame.find_markers();
  auto* keyframe = std::get_if<NewKeyframe>(&message);
  if (keyframe && result.world_from_rig) found = confirm(images, rig, map, result, found);
  if (found.empty()) return;
  auto markers = std::make_shared<const MarkerObservations>(std::move(found));
  if (keyframe) {
    keyframe->markers = std::move(markers);
    return;
  }
  for (InitialKeyframe& initial : std::get<NewSubmap>(message).keyframes) {
    if (initial.frame == frame.id) initial.markers = markers;
  }
}

}  // namespace waymark
