// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/rectification_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/camera/pixel_angles.h"
#include "waymark/marker/detect.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Rigid3 kBesideCam0(so3_exp({0.01, -0.02, 0.005}), {-0.11, 0.002, 0.001});

SequenceSpec pair_of(const char* camera_name) {
  SequenceSpec spec;
  const CameraDescription camera = named_camera(camera_name, 480);
  spec.chain = stereo_chain(camera, camera, kBesideCam0);
  spec.num_frames = 12;
  return spec;
}

RigCamera camera1_of(const char* camera_name) {
  return make_rig(pair_of(camera_name).chain).cameras[1];
}

/// Of all pixels that have any.
std::vector<Vector3d> bearings_of(const Camera& camera) {
  std::vector<Vector2d> pixels;
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x) pixels.emplace_back(x, y);
  }
  std::vector<Vector3d> all(pixels.size()), valid;
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, all, is_valid);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_valid[i]) valid.push_back(all[i]);
  }
  return valid;
}

TEST(RectificationError, IsNowhereLargerThanAskedAndSomewhereThatLarge) {
  for (const char* name : {"perspective", "fisheye", "ds"}) {
    SCOPED_TRACE(name);
    const RigCamera camera1 = camera1_of(name);
    const double pixel_rad = central_pixel_angle(*camera1.camera);
    const RectificationError error(camera1, {0.7, 0.3}, 5);
    Vector2d largest_px = Vector2d::Zero();
    for (const Vector3d& told : bearings_of(*camera1.camera)) {
      const Vector2d off_px = error.bearing_error().at(told) / pixel_rad;
      largest_px = largest_px.cwiseMax(off_px.cwiseAbs());
    }
    EXPECT_NEAR(largest_px[0], 0.7, 0.01);
    EXPECT_NEAR(largest_px[1], 0.3, 0.01);
  }
}

TEST(RectificationError, FollowsFromTheSeed) {
  const RigCamera camera1 = camera1_of("perspective");
  const auto terms = [&](std::uint64_t seed) {
    const RectificationError error(camera1, {1.0, 1.0}, seed);
    return error.bearing_error().along_rad;
  };
  EXPECT_EQ(terms(1), terms(1));
  EXPECT_NE(terms(1), terms(2));
}

TEST(RectificationError, ShowsThingsTooFarAlongTheEpipolarLineAndAcrossIt) {
  const RigCamera camera1 = camera1_of("fisheye");
  const Vector3d baseline = camera1.cam_from_rig.translation.normalized();
  const auto angle = [&](const Vector3d& bearing) { return std::acos(bearing.dot(baseline)); };
  for (const bool is_along : {true, false}) {
    const RectificationError error(camera1, {is_along ? 2.0 : 0.0, is_along ? 0.0 : 2.0}, 3);
    for (const Vector3d& told : bearings_of(*camera1.camera)) {
      if (std::abs(told.dot(baseline)) > 0.9) continue;
      const Vector3d truth = error.true_bearing(told);
      const Vector2d off_rad = error.bearing_error().at(told);
      EXPECT_NEAR(truth.norm(), 1.0, 1e-12);
      EXPECT_NEAR(told.cross(truth).norm(), off_rad.norm(), 1e-6);
      // Along the line it is seen nearer to camera 0's centre, as what is nearer is.
      const Vector3d across = told.cross(baseline).normalized();
      const Vector2d seen_off_rad(is_along ? angle(truth) - angle(told) : 0.0,
                                  (told - truth).dot(across));
      EXPECT_LT((seen_off_rad - off_rad).norm(), 1e-6);
    }
  }
}

TEST(RectificationError, IsNoneByDefault) {
  const Vector3d told = Vector3d(0.1, -0.3, 0.9).normalized();
  EXPECT_EQ(RectificationError().true_bearing(told), told);
}

/// Root mean square of how far corners of markers are seen from where camera 1 should see them, by
/// its calibration and by that and the error.
Vector2d corner_errors_px(SequenceSpec spec) {
  SimulatedSequence sequence(spec);
  const RigCamera& camera1 = sequence.rig().cameras[1];
  const RectificationError error(camera1, spec.warped_px, spec.seed);
  const MarkerDetector detector(MarkerFamily(sequence.markers().family));
  Vector2d sums = Vector2d::Zero();
  int count = 0;
  for (int i = 0; i < sequence.num_frames(); ++i) {
    const SimulatedFrame frame = sequence.frame(i);
    const Rigid3 cam_from_world = camera1.cam_from_rig * frame.world_from_rig.inverse();
    for (const MarkerObservation& seen :
         detector.detect(frame.images[1].view(), *camera1.camera, 1)) {
      for (std::size_t k = 0; k < 4; ++k) {
        const Vector3d corner = marker_corner(k, sequence.markers().size_of(seen.id));
        const Vector3d truth =
            (cam_from_world * *sequence.markers().pose_of(seen.id) * corner).normalized();
        const Vector3d told = seen.bearings[k].cast<double>().normalized();
        const Vector2d off_rad(told.cross(truth).norm(),
                               error.true_bearing(told).cross(truth).norm());
        sums += (off_rad / central_pixel_angle(*camera1.camera)).cwiseAbs2();
        ++count;
      }
    }
  }
  EXPECT_GT(count, 40);
  return (sums / count).cwiseSqrt();
}

TEST(RectificationError, IsRendered) {
  SequenceSpec spec = pair_of("perspective");
  spec.num_markers = 12;
  spec.num_frames = 6;
  const double straight_px = corner_errors_px(spec)[0];
  EXPECT_LT(straight_px, 0.3);
  spec.warped_px = {6.0, 3.0};
  const Vector2d warped_px = corner_errors_px(spec);
  EXPECT_GT(warped_px[0], 1.0);
  EXPECT_LT(warped_px[1], straight_px + 0.1);
}

TEST(RectificationError, LeavesCamera0AsItIs) {
  SequenceSpec spec = pair_of("perspective");
  const SimulatedFrame straight = SimulatedSequence(spec).frame(3);
  spec.warped_px = {1.0, 1.0};
  const SimulatedFrame warped = SimulatedSequence(spec).frame(3);
  EXPECT_EQ(warped.images[0].values, straight.images[0].values);
  EXPECT_NE(warped.images[1].values, straight.images[1].values);
  EXPECT_EQ(warped.images[1].values, SimulatedSequence(spec).frame(3).images[1].values);
}

}  // namespace
}  // namespace waymark
