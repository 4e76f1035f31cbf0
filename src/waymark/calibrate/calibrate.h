// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The calibration of a camera that nobody knows, from its images alone.
//
//   const EstimatedCalibration found = calibrate(input, CalibrateOptions());
//   std::cout << describe(found) << "\n";
//   if (found.is_sure) std::cout << format_camchain(found.chain());

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/calibrate/lens.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/input.h"

namespace waymark {

/// What is known, and how the search is followed.
struct CalibrateOptions {
  std::optional<double> fov_deg;      ///< Horizontal field of view, if it is roughly known.
  int seed = 0;                       ///< Of all random numbers.
  std::function<bool()> should_stop;  ///< Asked per frame; ends the search early. May be empty.
  /// Hears what is being done, for people. May be empty.
  std::function<void(const std::string&)> on_progress;
};

/// What images tell of the camera that took them.
struct EstimatedCalibration {
  LensModel model = LensModel::kPerspective;  ///< The one that fits best.
  CameraDescription camera;                   ///< Of the images as they are.
  LensChange sigmas = LensChange::Zero();     ///< Standard deviations of its numbers.
  double fov_deg = 0.0;                       ///< Horizontal, distortion included.
  bool is_sure = false;        ///< Whether the motion told the focal length, within some percent.
  std::string reason;          ///< What decided, in words.
  std::size_t num_frames = 0;  ///< That were looked at.
  std::size_t num_keyframes = 0;  ///< Of the map that the numbers are from; 0: there was none.

  /// As for -c.
  CameraChain chain() const;
};

/// The result in one line.
std::string describe(const EstimatedCalibration& calibration);
/// The same with all numbers, a line each.
std::vector<std::string> report(const EstimatedCalibration& calibration);

/// Finds the model and the numbers of the camera of an input from its images alone.
///
/// 360 degree images are known by their borders, fisheye lenses by the circle they light or by
/// their field of view. Fields of view and distortions compete in how well pairs of images, matched
/// by pixels, agree with any motion; from the best on, images are mapped with a calibration that is
/// free (recalibrate()), with what the map before told, until it stays. That is tried on stretches
/// of 300 frames, the first that tells being the last; a camera has one. Where the motion does not
/// tell, the likeliest is taken and is_sure is false. Takes its frames from the input; only camera
/// 0 counts. Throws InputError where there is no image. Repeatable by bits.
EstimatedCalibration calibrate(Input& input, const CalibrateOptions& options);

}  // namespace waymark
