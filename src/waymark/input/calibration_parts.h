// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the readers of other programs' calibrations share.

#include <string>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"

namespace waymark {

/// Spellings of one key; messages name the first.
using Keys = std::vector<std::string>;

/// The value of one of the keys of a map; nullptr where it has none, or is no map.
const ConfigNode* find_any(const ConfigNode& map, const Keys& keys);
/// The same; InputError where it has none.
const ConfigNode& require_any(const ConfigNode& map, const std::string& file, const Keys& keys);

/// The numbers of a matrix, row by row: {rows, cols, data}, or a list.
std::vector<double> matrix_values(const ConfigNode& node, const std::string& key);

/// OpenCV's names of a camera matrix.
const Keys& matrix_keys();

/// A pinhole camera by its camera matrix and the size of its images, without distortion. Throws
/// InputError for what is missing or malformed, and for skew.
CameraDescription read_size_and_matrix(const ConfigNode& root,
                                       const std::string& file,
                                       const Keys& matrix = matrix_keys());

/// OpenCV's order is that of radtan: k1 k2 p1 p2 k3 k4 k5 k6, then thin prism and tilt. All zero is
/// a camera without distortion.
void set_radial_tangential(CameraDescription& camera,
                           std::vector<double> coeffs,
                           const std::string& where);
void set_equidistant(CameraDescription& camera, std::vector<double> coeffs);

/// The chain of one camera, once a model has accepted it.
CameraChain checked_chain(const CameraDescription& camera);

}  // namespace waymark
