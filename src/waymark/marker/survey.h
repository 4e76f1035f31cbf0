// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/sim3.h"
#include "waymark/marker/known_markers.h"
#include "waymark/marker/marker.h"

namespace waymark {

/// A marker seen from a place of a map.
struct MarkerView {
  Rigid3 cam_from_map;                             ///< In units of the map.
  std::int64_t timestamp_ns = 0;                   ///< Of the image.
  const MarkerObservation* observation = nullptr;  ///< Not null; outlives the view.
};

/// What came of a marker.
enum class MarkerStatus : std::uint8_t {
  kSound,      ///< All fits.
  kFewViews,   ///< Seen too little, or from one side only, so that two poses may be.
  kMoved,      ///< It was in one place first and in another later.
  kTwice,      ///< It is in two places at a time.
  kWrongSize,  ///< By all others, it is of another size than was said.
  kMisplaced,  ///< By all others, it is elsewhere than was said.
  kNoSize,     ///< Nothing is known of its size.
};

/// A marker in a map.
struct SurveyedMarker {
  int id = 0;                                      ///< Its number.
  MarkerStatus verdict = MarkerStatus::kFewViews;  ///< Only what is sound is used.
  Sim3 map_from_marker;         ///< Of a square of side 1: its scale is the side in map units.
  double side_sigma = 0.0;      ///< Of the side, as a part of it.
  double rms_px = 0.0;          ///< Of the corners, of the views that fit.
  std::size_t num_views = 0;    ///< Moments of all of them.
  std::size_t num_fitting = 0;  ///< Moments of those that fit.
  std::int64_t changed_ns = 0;  ///< Of what moved: when it was seen at another place first.
  double found = 0.0;           ///< Side, or distance from where it should be, in metres.
  double expected = 0.0;        ///< The side that was said, in metres.
};

/// Finds pose and size of a marker in a map by all of its views, which are in the order of time and
/// may be wrong in part. Pairs of views give hypotheses, one for each of the two poses that a
/// single view leaves open (Collins and Bartoli 2014); that which most views fit is refined to the
/// least squared distances of the corners.
SurveyedMarker survey_marker(int id, std::span<const MarkerView> views);

/// How a map lies in the frame that its markers define.
struct MarkerFrame {
  /// What the frame rests on.
  enum class Basis : std::uint8_t { kScale, kMarker0, kSurvey };
  Basis basis = Basis::kScale;  ///< Nothing but the scale, marker 0, or surveyed poses.
  Sim3 world_from_map;          ///< In metres.
  double scale_sigma = 0.0;     ///< Of its scale, as a part of it; 0 where it was known.
  double rms_m = 0.0;           ///< Of the corners of surveyed markers; else 0.
};

/// Judges markers by each other and by what is known of them, and gives the frame of those that are
/// sound: that of the surveyed ones, else that of marker 0, else the map's own, in metres. Nothing
/// where they do not tell the scale. is_metric: the scale of the map is measured and stays.
std::optional<MarkerFrame> fit_marker_frame(const KnownMarkers& known,
                                            bool is_metric,
                                            std::span<SurveyedMarker> markers);

/// What came of a marker that was left out, in words: "marker 3: seen at two places ..."; empty for
/// a sound one.
std::string describe_fault(const SurveyedMarker& marker);

/// "scale", "marker 0", "surveyed".
std::string to_string(MarkerFrame::Basis basis);

/// One word or two: "used", "few views", "moved", "twice", "wrong size", "misplaced", "no size".
std::string to_string(MarkerStatus verdict);

}  // namespace waymark
