// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace waymark {

/// A camera in words and numbers, as settings and map files hold it.
struct CameraDescription {
  std::string camera_model;        ///< "pinhole" or the name of another registered model.
  std::vector<double> intrinsics;  ///< For pinhole fu fv pu pv, in pixels.
  /// "none", or the distortion of the model: "radtan", "equidistant".
  std::string distortion_model = "none";
  std::vector<double> distortion_coeffs;  ///< For radtan k1 k2 p1 p2, for equidistant k1 k2 k3 k4.
  int width_px = 0;                       ///< Of the images.
  int height_px = 0;                      ///< Of the images.
  std::string where;                      ///< Begins error messages, for example "camchain.yaml:3".

  /// The same camera, wherever it was written.
  bool is_same(const CameraDescription& other) const;

  /// InputError at `where`, for factories.
  [[noreturn]] void fail(const std::string& what) const;
};

}  // namespace waymark
