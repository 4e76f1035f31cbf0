// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/camera/calibration.h"
#include "waymark/map/map.h"
#include "waymark/optimize/bundle.h"

namespace waymark {

/// Readouts are that long: around what was given or, where nothing was, around none.
inline constexpr double kReadoutPriorS = 0.02;

/// Offsets of inverse depths are that large, in 1/m.
inline constexpr double kDepthOffsetPrior = 0.02;

/// What is known of the calibration of the cameras in use.
struct KnownCalibration {
  std::shared_ptr<const Rig> given;  ///< By the user: the prior of every estimate.
  std::shared_ptr<const Rig> rig;    ///< With which the map is measured.
  /// Change of `rig` from `given`, in the order of `parameters`.
  Eigen::VectorXd change;
  /// Standard deviation of each change as the images tell it; of the prior before they did.
  Eigen::VectorXd sigma;
  std::vector<CalibrationParameter> parameters;
  /// Whether every parameter becomes its estimate, also where the images do not contradict it.
  bool is_always_refined = false;
  /// Of a rolling shutter, as the user says; that in use is in `rig`, and in `given`, too.
  double given_readout_s = 0.0;
  double readout_sigma_s = 0.0;  ///< Standard deviation of the estimate; 0 where there is none.
  /// Of depth images, as the user says; that in use is in `rig`, and in `given`, too.
  double given_depth_offset = 0.0;
  double depth_offset_sigma = 0.0;  ///< Standard deviation of the estimate; 0 where there is none.
  /// Before a map has so many keyframes only the readout is estimated, which few tell.
  std::size_t min_keyframes = 0;

  /// The same, parameter by parameter.
  std::vector<CalibrationEstimate> estimates() const;
  /// Whether the images have changed it.
  bool is_changed() const { return rig != given; }

  /// A calibration that is believed so far.
  static KnownCalibration as_given(std::shared_ptr<const Rig> rig, bool is_always_refined = false);
};

/// Adjusts the calibration together with the poses and points of a problem, whose observations are
/// `observed` in the map, and measures the problem anew with what it finds. Nothing, and the
/// problem left alone, where the images do not contradict the calibration. Only the parameters that
/// they do contradict change.
std::optional<KnownCalibration> recalibrate(const Map& map,
                                            std::span<const Observation> observed,
                                            const KnownCalibration& known,
                                            BundleProblem& problem);

}  // namespace waymark
