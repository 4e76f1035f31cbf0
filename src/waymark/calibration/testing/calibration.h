// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/track/testing/map.h"

namespace waymark {

inline CameraDescription make_test_pinhole(double focal_px,
                                           std::vector<double> radtan = {0.0, 0.0, 0.0, 0.0}) {
  return {"pinhole", {focal_px, focal_px, 319.5, 239.5}, "radtan", std::move(radtan), 640, 480, ""};
}

/// One camera, or two of which the second is turned about its y axis and 0.12 m to the right.
inline std::shared_ptr<const Rig> make_described(int num_cameras,
                                                 const CameraDescription& description,
                                                 double turn_rad = 0.0) {
  CameraChain chain;
  chain.cameras.push_back({description, Rigid3()});
  const Rigid3 beside(so3_exp({0.0, turn_rad, 0.0}), Eigen::Vector3d::Zero());
  const Rigid3 shifted(Eigen::Quaterniond::Identity(), {-0.12, 0.0, 0.0});
  if (num_cameras > 1) chain.cameras.push_back({description, beside * shifted});
  return std::make_shared<const Rig>(make_rig(chain));
}

/// Keyframes of a rig that looks around while it goes, measured as another calibration tells.
/// inverse_range_sigma: of a depth image beside one camera, in 1/m; 0: there is none.
inline TestMap look_around(std::shared_ptr<const Rig> truth,
                           const std::shared_ptr<const Rig>& told,
                           std::uint32_t num_keyframes,
                           double pixel_sigma = 0.3,
                           double inverse_range_sigma = 0.0) {
  const int num_cameras = static_cast<int>(truth->cameras.size());
  TestMap scene(num_cameras,
                scatter_in({-6.0, -4.0, 3.0}, {6.0, 4.0, 9.0}, 2000, 6.0, 3),
                {.seed = 9,
                 .pixel_sigma = pixel_sigma,
                 .inverse_range_sigma = inverse_range_sigma,
                 .max_features = 500},
                num_cameras > 1 || inverse_range_sigma > 0.0);
  scene.rig = std::move(truth);
  for (std::uint32_t k = 0; k < num_keyframes; ++k) {
    const KeyframeId id = scene.add_keyframe(
        make_test_pose({0.15 * k, 0.1 * (k % 3), 0.1 * (k % 5)},
                       {0.1 * (k % 4 - 1.5), 0.12 * (k % 5 - 2.0), 0.2 * (k % 3)}));
    const Features& seen = *scene.map.keyframes().at(id).features;
    scene.map.recompute_keyframe(id, recompute(seen, told, {}));
  }
  return scene;
}

}  // namespace waymark
