// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>

#include "waymark/mapping/mapper.h"
#include "waymark/mapping/markers.h"

namespace waymark {

/// Puts the map into the frame of its markers once they tell it, and what is seen of them later to
/// where it belongs in that.
class MarkerPlacement {
 public:
  /// known: what is known of the markers beforehand; nothing: none are looked for.
  explicit MarkerPlacement(std::optional<KnownMarkers> known) : known_(std::move(known)) {}

  /// After a keyframe: surveys the markers of its sub-map where that is due. Gives the sub-map that
  /// was moved by them.
  std::optional<SubmapId> look_at(KeyframeId newest, Mapper& mapper);

  /// The end: places all sub-maps, the largest first, whose markers then are known to the others,
  /// and adjusts them with their markers. What has a scale by these is in metres.
  void place_all(Mapper& mapper);

  /// Of the sub-map with most keyframes, as surveyed last; empty where no markers are looked for.
  const MarkerSurvey& survey() const { return survey_; }

 private:
  /// Keyframes of a sub-map with markers when they are surveyed first, then at a quarter more.
  static constexpr std::size_t kFirstSurvey = 5;

  const std::optional<KnownMarkers> known_;
  MarkerSurvey survey_;
  std::map<SubmapId, MarkerFrame::Basis> placed_;  ///< Sub-maps that are in a frame of markers.
  std::size_t next_survey_ = kFirstSurvey;         ///< Keyframes with markers when it is due again.
};

}  // namespace waymark
