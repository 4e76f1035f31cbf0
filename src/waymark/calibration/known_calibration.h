// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "waymark/camera/calibration.h"

namespace waymark {

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
  /// Before a map has so many keyframes only the readout is estimated, which few tell.
  std::size_t min_keyframes = 0;

  /// The same, parameter by parameter; the readout once, and it and the offset of depth images only
  /// where the images have told them.
  std::vector<CalibrationEstimate> estimates() const;
  /// Whether images have told any of it.
  bool is_told() const;
  /// Whether the images have changed it.
  bool is_changed() const { return rig != given; }

  /// A calibration that is believed so far.
  static KnownCalibration as_given(std::shared_ptr<const Rig> rig, bool is_always_refined = false);
};

}  // namespace waymark
