// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/exchange/openvslam_records.h"
#include "waymark/image/features.h"
#include "waymark/input/input.h"

namespace waymark {

/// What the key points of a keyframe were seen by.
struct OpenvslamView {
  OpenvslamPyramid pyramid;
  Setup setup = Setup::kMono;
  std::shared_ptr<const Rig> rig;
  /// Of camera 0; nothing where key points are pixels of the camera itself (equirectangular).
  std::vector<double> undistorted_intrinsics;
  std::string where;  ///< Begins error messages.
};

struct OpenvslamFeatures {
  std::shared_ptr<const Features> features;
  std::vector<std::uint32_t> feature_of_keypoint;  ///< kNoFeature where it has no bearing.
};

/// The key points of a keyframe as our features: distorted again, with the level of our pyramid
/// that comes next to theirs, and with what follows from the camera computed by our own code. Key
/// points that the camera cannot have seen are left out.
OpenvslamFeatures convert_openvslam_features(const OpenvslamKeyframe& keyframe,
                                             const OpenvslamView& view);

}  // namespace waymark
