// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibration/known_calibration.h"

#include <utility>

namespace waymark {

KnownCalibration KnownCalibration::as_given(std::shared_ptr<const Rig> rig,
                                            bool is_always_refined) {
  KnownCalibration known{rig, rig, {}, {}, CalibrationParameters(*rig).list()};
  const auto count = static_cast<Eigen::Index>(known.parameters.size());
  known.change.setZero(count);
  known.sigma.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    known.sigma[i] = known.parameters[static_cast<std::size_t>(i)].prior_sigma;
  }
  known.is_always_refined = is_always_refined;
  return known;
}

bool KnownCalibration::is_told() const {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (sigma[static_cast<Eigen::Index>(i)] != parameters[i].prior_sigma) return true;
  }
  return false;
}

std::vector<CalibrationEstimate> KnownCalibration::estimates() const {
  std::vector<CalibrationEstimate> estimates;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const CalibrationParameter& parameter = parameters[i];
    const bool is_of_sensor = parameter.group == CalibrationGroup::kReadout ||
                              parameter.group == CalibrationGroup::kDepthOffset;
    const bool is_repeated = parameter.name.ends_with(".readout_ms");
    if (is_repeated || (is_of_sensor && sigma[at] == parameter.prior_sigma)) continue;
    estimates.push_back(
        {parameter.name, parameter.given, change[at], parameter.prior_sigma, sigma[at]});
  }
  return estimates;
}

}  // namespace waymark
