// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "waymark/match/appearance.h"

namespace waymark {

/// Finds those matches of two images, taken at about the same place, that agree on how the camera
/// turned in between. The bearing and the orientation of a feature are a frame in space, so that a
/// single match tells the whole rotation; matches by chance tell any. What Hough voting for the
/// rotation of an image does (Lowe 2004, 7.3) on the sphere, for cameras of any lens. Keeps its
/// buffers.
class RotationVote {
 public:
  /// The matches that agree with the rotation that most agree with, in their order; stays valid
  /// until the next call. By chance one in a hundred agrees.
  std::span<const FeatureMatch> agreeing(const Features& a,
                                         const Features& b,
                                         std::span<const FeatureMatch> matches);

 private:
  std::vector<Eigen::Vector4f> turns_;  ///< Unit quaternions.
  std::vector<FeatureMatch> agreeing_;
};

}  // namespace waymark
