// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/marker/survey.h"

namespace waymark {

/// What the keyframes of a sub-map tell of markers and of the frame that these define.
struct MarkerSurvey {
  std::vector<SurveyedMarker> markers;  ///< By number.
  std::optional<MarkerFrame> frame;     ///< Where they tell the scale.
};

/// Surveys all markers that a sub-map's keyframes see.
MarkerSurvey survey_markers(const Map& map, SubmapId submap, const KnownMarkers& known);

/// Whether a survey is worth moving a map for while it grows: its scale is known to within 1 %.
bool is_firm(const MarkerSurvey& survey);

/// Puts a sub-map where its markers have it, in metres, and notes these. Its scale stays free if it
/// was. Nothing without a frame.
void place_by_markers(Map& map,
                      SubmapId submap,
                      const KnownMarkers& known,
                      const MarkerSurvey& survey);

/// Notes the sound markers of a survey as those of a sub-map, which from then on hold it in
/// adjustments. world_from_map: how the sub-map was moved since it was surveyed.
void note_markers(Map& map,
                  SubmapId submap,
                  const KnownMarkers& known,
                  const MarkerSurvey& survey,
                  const Sim3& world_from_map);

/// What is known of markers with those of a sub-map as if they had been surveyed where they are, so
/// that other sub-maps come to lie in the same frame.
KnownMarkers with_placed_markers(const Map& map, SubmapId submap, const KnownMarkers& known);

/// Keyframes of a sub-map that see markers.
std::size_t count_marker_keyframes(const Map& map, SubmapId submap);

}  // namespace waymark
