// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/markers.h"

#include <algorithm>
#include <map>
#include <utility>

#include "waymark/map/align.h"

namespace waymark {
namespace {

constexpr double kFirmScaleSigma = 0.01;

std::map<int, std::vector<MarkerView>> list_views(const Map& map, SubmapId submap) {
  std::map<int, std::vector<MarkerView>> views;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.submap != submap || !keyframe.markers) return;
    for (const MarkerObservation& observation : *keyframe.markers) {
      const Rigid3& cam_from_rig = keyframe.rig().cameras[observation.camera].cam_from_rig;
      views[observation.id].push_back(
          {cam_from_rig * keyframe.rig_from_world, keyframe.timestamp_ns, &observation});
    }
  });
  for (auto& [id, of_marker] : views) {
    std::ranges::stable_sort(of_marker, {}, &MarkerView::timestamp_ns);
  }
  return views;
}

/// The keyframe that sees a marker from nearest, so that it moves with what it is surrounded by.
KeyframeId reference_of(const Map& map, SubmapId submap, int id, const Eigen::Vector3d& position) {
  KeyframeId nearest;
  double least = 0.0;
  map.keyframes().for_each([&](KeyframeId keyframe_id, const Keyframe& keyframe) {
    if (keyframe.submap != submap || !keyframe.markers) return;
    if (!std::ranges::count(*keyframe.markers, id, &MarkerObservation::id)) return;
    const double distance = (keyframe.rig_from_world * position).norm();
    if (nearest.is_valid() && distance >= least) return;
    nearest = keyframe_id;
    least = distance;
  });
  return nearest;
}

}  // namespace

std::size_t count_marker_keyframes(const Map& map, SubmapId submap) {
  std::size_t count = 0;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    count += keyframe.submap == submap && keyframe.markers;
  });
  return count;
}

MarkerSurvey survey_markers(const Map& map, SubmapId submap, const KnownMarkers& known) {
  MarkerSurvey survey;
  for (const auto& [id, views] : list_views(map, submap)) {
    survey.markers.push_back(survey_marker(id, views));
  }
  const bool is_metric = has_measured_ranges(map, submap);
  survey.frame = fit_marker_frame(known, is_metric, survey.markers);
  return survey;
}

bool is_firm(const MarkerSurvey& survey) {
  return survey.frame && survey.frame->scale_sigma < kFirmScaleSigma;
}

void place_by_markers(Map& map,
                      SubmapId submap,
                      const KnownMarkers& known,
                      const MarkerSurvey& survey) {
  if (!survey.frame) return;
  transform_submap(map, submap, survey.frame->world_from_map);
  note_markers(map, submap, known, survey, survey.frame->world_from_map);
}

void note_markers(Map& map,
                  SubmapId submap,
                  const KnownMarkers& known,
                  const MarkerSurvey& survey,
                  const Sim3& world_from_map) {
  std::vector<MapMarker> markers;
  for (const MapMarker& marker : map.markers()) {
    if (map.submap_of(marker) != submap) markers.push_back(marker);
  }
  for (const SurveyedMarker& surveyed : survey.markers) {
    if (surveyed.verdict != MarkerStatus::kSound) continue;
    const Sim3 placed = world_from_map * surveyed.map_from_marker;
    Rigid3 world_from_marker(placed.rotation, placed.translation);
    MapMarker marker;
    marker.id = surveyed.id;
    marker.side_m = known.size_of(surveyed.id);
    const Rigid3* pose = known.pose_of(surveyed.id);
    if (pose && survey.frame && survey.frame->basis == MarkerFrame::Basis::kSurvey) {
      marker.surveyed_world_from_marker = *pose;
      world_from_marker = *pose;
    }
    marker.reference = reference_of(map, submap, surveyed.id, world_from_marker.translation);
    const Keyframe& reference = map.keyframes().at(marker.reference);
    marker.reference_scale = reference.applied_scale;
    marker.marker_from_reference = world_from_marker.inverse() * reference.rig_from_world.inverse();
    markers.push_back(marker);
  }
  std::ranges::stable_sort(markers, {}, &MapMarker::id);
  map.set_markers(std::move(markers));
}

KnownMarkers with_placed_markers(const Map& map, SubmapId submap, const KnownMarkers& known) {
  KnownMarkers placed = known;
  for (const MapMarker& marker : map.markers()) {
    if (map.submap_of(marker) != submap || known.pose_of(marker.id)) continue;
    placed.by_id[marker.id].world_from_marker = map.world_from_marker(marker);
  }
  return placed;
}

}  // namespace waymark
