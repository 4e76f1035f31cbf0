// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/base/settings.h"
#include "waymark/camera/rig.h"
#include "waymark/camera/tangent.h"
#include "waymark/image/features.h"
#include "waymark/image/pyramid.h"

namespace waymark {

struct StereoSettings {
  double min_range_baselines = 4.0;

  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("min_range_baselines",
          self.min_range_baselines,
          SettingInfo{.low = 0.1,
                      .high = 1000.0,
                      .help = "Nearest range that stereo search looks at, in baselines."});
  }
};

/// A feature of camera 0 found again in camera 1.
struct StereoMatch {
  std::uint32_t primary;  ///< Index of the feature of camera 0.
  Eigen::Vector2d pixel;  ///< In camera 1, level 0, sub-pixel.
  std::uint8_t level;     ///< Pyramid level of camera 1 that shows it as large as camera 0 does.
};

/// Finds features of camera 0 in the image of camera 1 by search along their epipolar curves: the
/// ray of a feature, from infinity to the nearest range, as camera 1 sees it. Nothing is rectified;
/// the two cameras may differ in model, resolution and direction. Keeps its buffers: no allocation
/// after warm-up.
class StereoSearch {
 public:
  /// rig: two cameras, some distance apart; else InputError.
  StereoSearch(const Rig& rig, const StereoSettings& settings);

  /// tangents: of the keypoints, in camera 0, all valid. The result, in ascending order of the
  /// primary feature, stays valid until the next call.
  std::span<const StereoMatch> search(const Pyramid& image0,
                                      const Pyramid& image1,
                                      std::span<const Keypoint> keypoints,
                                      const TangentArrays& tangents);
};

/// Distance along the bearing of camera 0 at which the point comes closest to the bearing of
/// camera 1, as an angle; 0 where that is nearer to infinity than
/// size_rad / 2 in camera 1, or behind.
float range_along_bearing(const Rigid3& cam1_from_cam0,
                          const Eigen::Vector3d& bearing0,
                          const Eigen::Vector3d& bearing1,
                          double size1_rad);

}  // namespace waymark
