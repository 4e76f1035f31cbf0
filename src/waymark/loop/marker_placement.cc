// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/marker_placement.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "waymark/map/align.h"

namespace waymark {
namespace {

/// Placing and adjusting by turns: markers that were seen since the last survey join in.
constexpr int kMarkerPasses = 2;

}  // namespace

std::optional<SubmapId> MarkerPlacement::look_at(KeyframeId newest, Mapper& mapper) {
  const Keyframe* keyframe = mapper.map().keyframes().find(newest);
  if (!known_ || !keyframe || !keyframe->markers) return std::nullopt;
  const SubmapId submap = keyframe->submap;
  const std::size_t count = count_marker_keyframes(mapper.map(), submap);
  if (count < next_survey_) return std::nullopt;
  next_survey_ = count + std::max<std::size_t>(count / 4, 1);
  survey_ = survey_markers(mapper.map(), submap, *known_);
  if (!is_firm(survey_)) return std::nullopt;
  const MarkerFrame::Basis basis = survey_.frame->basis;
  const auto placed = placed_.find(submap);
  const bool is_to_move = placed == placed_.end() || placed->second < basis;
  mapper.change([&](Map& map, DirtyLandmarks&) {
    if (is_to_move) {
      place_by_markers(map, submap, *known_, survey_);
    } else {
      note_markers(map, submap, *known_, survey_, Sim3());
    }
  });
  if (!is_to_move) return std::nullopt;
  placed_[submap] = basis;
  return submap;
}

void MarkerPlacement::place_all(Mapper& mapper) {
  if (!known_) return;
  KnownMarkers known = *known_;
  const std::vector<SubmapId> submaps = submaps_by_size(mapper.map());
  for (const SubmapId submap : submaps) {
    MarkerSurvey survey = survey_markers(mapper.map(), submap, known);
    for (int pass = 0; survey.frame && pass < kMarkerPasses; ++pass) {
      mapper.change(
          [&](Map& map, DirtyLandmarks&) { place_by_markers(map, submap, known, survey); });
      mapper.apply(adjust_globally(mapper.map(), submap));
      survey = survey_markers(mapper.map(), submap, known);
    }
    if (survey.frame) {
      mapper.change([&](Map& map, DirtyLandmarks&) {
        place_by_markers(map, submap, known, survey);
        if (!map.submaps()[submap.value].is_metric) map = declare_metric(map, submap);
      });
      known = with_placed_markers(mapper.map(), submap, known);
    }
    if (submap == submaps.front()) survey_ = std::move(survey);
  }
}

}  // namespace waymark
