// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/picture_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "waymark/mapping/global_adjustment.h"
#include "waymark/mapping/test_calibration.h"

namespace waymark {
namespace {

constexpr std::uint32_t kNumKeyframes = 14;
constexpr double kFocalPx = 420.0;

/// As look_around(), but for the principal point, which moves in the image by up to shift_px.
TestMap look_through(double shift_px, const CameraDescription& lens) {
  const auto told = make_described(1, make_test_pinhole(kFocalPx));
  TestMap scene(1,
                scatter_in({-6.0, -4.0, 3.0}, {6.0, 4.0, 9.0}, 2000, 6.0, 3),
                {.seed = 9, .pixel_sigma = 0.3, .max_features = 500},
                false);
  for (std::uint32_t k = 0; k < kNumKeyframes; ++k) {
    CameraDescription camera = lens;
    camera.intrinsics[2] += shift_px * std::sin(2.0 * k);
    camera.intrinsics[3] += 0.5 * shift_px * std::cos(3.0 * k);
    scene.rig = make_described(1, camera);
    const KeyframeId id = scene.add_keyframe(
        make_test_pose({0.15 * k, 0.1 * (k % 3), 0.1 * (k % 5)},
                       {0.1 * (k % 4 - 1.5), 0.12 * (k % 5 - 2.0), 0.2 * (k % 3)}));
    const Features& seen = *scene.map.keyframes().at(id).features;
    scene.map.measure_keyframe(id, told, measure_anew(seen, *told, {}));
  }
  // As sessions do: poses and landmarks have made the best of it.
  DirtyLandmarks dirty;
  for (int i = 0; i < 3; ++i) {
    apply_adjustment(scene.map, adjust_globally(*scene.map.freeze(), scene.submap), dirty);
  }
  return scene;
}

TEST(PictureMotion, FindsPicturesThatMove) {
  const auto motion = find_picture_motion(look_through(12.0, make_test_pinhole(kFocalPx)).map);
  ASSERT_TRUE(motion);
  EXPECT_TRUE(motion->is_stabilised());
  EXPECT_EQ(motion->width_px, 640);
  // The scatter of a sine is 0.7 of its amplitude; a part is taken for motion.
  EXPECT_GT(motion->scatter_px, 4.0);
  EXPECT_LT(motion->scatter_px, 16.0);
}

TEST(PictureMotion, LeavesSteadyPicturesInPeace) {
  const auto motion = find_picture_motion(look_through(0.0, make_test_pinhole(kFocalPx)).map);
  ASSERT_TRUE(motion);
  EXPECT_FALSE(motion->is_stabilised());
  EXPECT_LT(motion->scatter_px, 1.5);
  EXPECT_LT(motion->explained, 0.05);
}

TEST(PictureMotion, LeavesWrongCalibrationsInPeace) {
  CameraDescription centre = make_test_pinhole(kFocalPx);
  centre.intrinsics[2] += 12.0;
  for (const CameraDescription& lens : {make_test_pinhole(1.03 * kFocalPx),
                                        make_test_pinhole(kFocalPx, {-0.05, 0.0, 0.0, 0.0}),
                                        centre}) {
    const auto motion = find_picture_motion(look_through(0.0, lens).map);
    ASSERT_TRUE(motion);
    EXPECT_FALSE(motion->is_stabilised()) << motion->scatter_px << " " << motion->explained;
  }
}

TEST(PictureMotion, SaysNothingOfFewKeyframes) {
  EXPECT_FALSE(find_picture_motion(Map()));
  TestMap scene = look_around(make_described(1, make_test_pinhole(kFocalPx)),
                              make_described(1, make_test_pinhole(kFocalPx)),
                              5);
  EXPECT_FALSE(find_picture_motion(scene.map));
}

}  // namespace
}  // namespace waymark
