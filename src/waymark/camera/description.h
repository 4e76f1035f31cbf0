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
  std::string distortion_model = "none";
  std::vector<double> distortion_coeffs;
  int width_px = 0;
  int height_px = 0;
  std::string where;  ///< Begins error messages, for example "camchain.yaml:3".

  /// The same camera, wherever it was written.
  bool is_same(const CameraDescription& other) const;

  /// InputError at `where`, for factories.
  [[noreturn]] void fail(const std::string& what) const;
};

}  // namespace waymark
