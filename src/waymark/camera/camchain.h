// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cameras as Kalibr writes them.
//
//   const ConfigNode config = parse_config(ConfigSource::from_file("camchain.yaml"));
//   if (const std::optional<CameraChain> chain = read_camchain(config)) {
//     const Rig cameras = make_rig(*chain);
//     std::cout << cameras.cameras.size() << " cameras\n" << format_camchain(*chain);
//   }

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/camera/registry.h"
#include "waymark/camera/rig.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {

/// A camera of a chain; camera 0 is the rig's origin.
struct ChainCamera {
  CameraDescription description;  ///< Model and numbers, not checked yet.
  Rigid3 cam_from_rig;            ///< Identity for camera 0; translation in metres.
  double readout_s = 0.0;         ///< See RigCamera.
  CalibrationSigmas sigmas = {};  ///< How sure that is.
};

/// The calibration of a rig, as written: cameras are made of it by make_rig().
struct CameraChain {
  std::vector<ChainCamera> cameras;    ///< cam0, cam1, ... in order.
  std::optional<double> depth_factor;  ///< Units of the depth image per metre.
  std::vector<std::string> notes;      ///< What was ignored, each with its place.
};

/// Reads cam0, cam1, ... and depth of a document in the format of Kalibr's camchain files; nothing
/// if it has no camera. Other keys at the top belong to settings. Throws InputError for what is
/// malformed, with its line; models and their numbers are checked by make_rig().
std::optional<CameraChain> read_camchain(const ConfigNode& config);

/// depth.factor of such a document, which may be all of it; nothing if it has none. Throws
/// InputError.
std::optional<double> read_depth_factor(const ConfigNode& config);

/// The chain in Kalibr's format, as read_camchain() reads it, with the standard deviations that it
/// has.
std::string format_camchain(const CameraChain& chain);

/// Makes the cameras. Throws InputError for what a model refuses.
Rig make_rig(const CameraChain& chain,
             const CameraRegistry& registry = CameraRegistry::with_builtin_models());

/// A matrix of so many rows of as many numbers. Throws InputError.
Eigen::MatrixXd read_square_matrix(const ConfigNode& node, const std::string& key, int size);

/// A rigid motion from 4 rows of 4 numbers of a document, as below. Throws InputError.
Rigid3 read_transform(const ConfigNode& node, const std::string& key);

/// A rigid motion from a 4x4 matrix of a file: InputError at `where` unless the rotation is
/// orthonormal within 1e-3 (it is then made so exactly) and the last row is 0 0 0 1.
Rigid3 rigid_from_matrix(const Eigen::Matrix4d& matrix,
                         const std::string& where,
                         std::string_view name);

}  // namespace waymark
