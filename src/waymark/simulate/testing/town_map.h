// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/simulate/testing/town_recording.h"

namespace waymark {

/// One perspective camera of 640 x 480 pixels, or two of them 0.4 m apart, that map files can hold.
std::shared_ptr<const Rig> make_town_rig(int num_cameras);

/// A map of a town that grows with it: as many passes of each street whatever the size.
struct TownMapSettings {
  std::uint64_t seed = 1;
  std::size_t num_keyframes = 1000;
  std::size_t num_recordings = 1;  ///< Of as many keyframes each.
  double step_m = 1.0;             ///< Between keyframes.
  double num_passes = 3.0;         ///< Of each street, in the mean.
  std::uint32_t max_features = 300;
  bool is_metric = true;        ///< With depth; else mono.
  double repeated_share = 0.0;  ///< Of the houses, see TownSettings.
  double landmark_share = 0.6;  ///< Of the points, which become landmarks where two see them.
  /// Whether what is seen again is known again, as when loops were closed and all was adjusted, and
  /// poses are right but for noise. Otherwise each recording is a sub-map, odometry drifts, and
  /// what was out of sight for a while gets landmarks anew.
  bool is_closed = true;
  double drift_of_way = 0.002;     ///< Standard deviation of the error of a step, in parts of it.
  double turn_of_step_rad = 5e-5;  ///< The same of its rotation.
};

/// A map with the truth about it.
struct TownMap {
  std::shared_ptr<const Town> town;
  std::shared_ptr<const Rig> rig;
  std::shared_ptr<const Map> map;      ///< Covisibility, parents, appearance: all complete.
  std::vector<Rigid3> world_from_rig;  ///< The truth, per keyframe.
  /// Where the way comes to a place that it knew before, and how the two truly lie to each other.
  /// All but the last are loop edges of a closed map.
  std::vector<LoopEdge> revisits;
};

/// Makes it of what its frames show, with known associations: seconds per 10 000 keyframes. The
/// same settings give the same bits.
TownMap make_town_map(const TownMapSettings& settings);

/// The town that make_town_map() makes, and its recordings.
std::shared_ptr<const Town> make_town_for(const TownMapSettings& settings);
TownRecording make_town_recording(std::shared_ptr<const Town> town,
                                  std::shared_ptr<const Rig> rig,
                                  const TownMapSettings& settings,
                                  std::size_t recording);

}  // namespace waymark
