// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "waymark/mapping/bundle_window.h"

namespace waymark {

/// Keyframes that are adjusted together; more are in parts of so many, and their calibration stays.
inline constexpr std::size_t kMaxAdjustedAtOnce = 3000;

/// What adjusting a whole sub-map, or all of them, finds, on a frozen map, for a map that has gone
/// on since.
struct GlobalAdjustment {
  MapCorrection correction;
  std::vector<Observation> outliers;
  std::vector<LandmarkId> landmarks;                           ///< That were adjusted, ascending.
  std::optional<KnownCalibration> calibration = std::nullopt;  ///< Where it changed.
};

/// Bundle adjustment over all of a sub-map; its root stays. In mono the scale around each keyframe
/// is how much further away the landmarks that it sees are than before, in the median. Of a large
/// one see compute_adjustment_in_parts(). Any thread; nothing is shared. Uses all cores.
GlobalAdjustment adjust_globally(const Map& frozen, SubmapId submap);

/// The same with what an IMU measured, for a sub-map of at most kMaxAdjustedAtOnce keyframes; empty
/// where it is larger, and where they contradict each other.
GlobalAdjustment adjust_with_imu(const Map& frozen, SubmapId submap, const InertialEvidence& imu);

/// The same over all sub-maps, and the calibration along with them: each tells of it what it shows.
/// What a large map is made of has told it long before.
GlobalAdjustment adjust_with_calibration(const Map& frozen, const KnownCalibration& known);

/// Carries what was found on `before` over to the map of now, which was moved since by other
/// corrections, as of a loop that was closed: around each keyframe it moves as the map did. What is
/// gone is left out.
void rebase(const Map& before, const Map& now, GlobalAdjustment& adjustment);

/// Takes in what was found but the calibration: moves what was known, lets what is younger follow,
/// drops outliers.
void apply_adjustment(Map& map, const GlobalAdjustment& adjustment, DirtyLandmarks& dirty);

}  // namespace waymark
