// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "waymark/calibration/recalibrate.h"
#include "waymark/map/correction.h"
#include "waymark/map/map.h"
#include "waymark/mapping/associate.h"
#include "waymark/mapping/inertial_bundle.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// Part of a map to be adjusted together: keyframes that move, keyframes that hold it in place,
/// landmarks, each ascending by id.
struct BundleWindow {
  std::vector<KeyframeId> moving;
  std::vector<KeyframeId> fixed;
  std::vector<LandmarkId> landmarks;
};

/// The keyframes most covisible with one, what they see, and who else sees that.
BundleWindow choose_window(const Map& map,
                           KeyframeId centre,
                           std::size_t num_keyframes,
                           std::size_t max_fixed = std::size_t{25});

/// A whole sub-map; its root is fixed, unless surveyed markers hold it.
BundleWindow whole_submap(const Map& map, SubmapId submap);

/// All sub-maps; their roots are fixed, but where surveyed markers hold them.
BundleWindow whole_map(const Map& map);

/// What adjusting a window finds.
struct WindowAdjustment {
  MapCorrection correction;           ///< Of all that moves, without scales.
  std::vector<Observation> outliers;  ///< Ascending by landmark.
  std::optional<KnownCalibration> calibration = std::nullopt;  ///< Where it changed.
};

/// Adjusts a window and leaves the map as it is.
/// \param known  the calibration that is to be adjusted along, or null.
/// \param start  where what it names begins; null: all of it where the map has it. Without known.
/// \param imu  what ties its keyframes, or null. Without known. Nothing moves where they
/// contradict.
WindowAdjustment compute_adjustment(const Map& map,
                                    const BundleWindow& window,
                                    const BundleOptions& options,
                                    const KnownCalibration* known = nullptr,
                                    const MapCorrection* start = nullptr,
                                    const InertialEvidence* imu = nullptr);

/// Looks for the readout of a rolling shutter in what a window sees; nothing where the images do
/// not contradict that in use, or more than that is known of the calibration: see recalibrate().
std::optional<KnownCalibration> look_for_readout(const Map& map,
                                                 const BundleWindow& window,
                                                 const KnownCalibration& known);

/// Removes observations, where they still exist, and of the landmarks those without support.
/// Returns the erased landmarks.
std::vector<LandmarkId> drop_outliers(Map& map,
                                      std::span<const Observation> outliers,
                                      std::span<const LandmarkId> landmarks,
                                      DirtyLandmarks& dirty);

/// Adjusts a window, writes it back and drops the observations that turned out wrong, with the
/// landmarks that lose their support. Returns the erased landmarks.
std::vector<LandmarkId> adjust_window(Map& map,
                                      const BundleWindow& window,
                                      const BundleOptions& options,
                                      DirtyLandmarks& dirty);

/// Whether what is left of a landmark's observations fixes its position: two keyframes, or a
/// range that fits in one.
bool is_supported(const Map& map, const Landmark& landmark);

}  // namespace waymark
