// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/stitch.h"

#include <gtest/gtest.h>

#include "waymark/base/check.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

constexpr int kHeightPx = 90;

Image plain(std::uint8_t grey) {
  Image image(2 * kHeightPx, kHeightPx);
  std::fill(image.values.begin(), image.values.end(), grey);
  return image;
}

TEST(Stitch, TheMiddleIsFromTheFrontAndTheSidesAreFromTheBack) {
  const Rig rig = make_rig(mono_chain(named_camera("equirectangular", kHeightPx)));
  const Image joined = Stitch(*rig.cameras[0].camera).join(plain(200), plain(100));
  const int quarter = kHeightPx / 2;
  for (int y = 5; y < kHeightPx - 5; ++y) {
    EXPECT_EQ(joined.row(y)[kHeightPx], 200);
    EXPECT_EQ(joined.row(y)[quarter + 10], 200);
    EXPECT_EQ(joined.row(y)[0], 100);
    EXPECT_EQ(joined.row(y)[quarter - 10], 100);
    EXPECT_EQ(joined.row(y)[2 * kHeightPx - 1], 100);
  }
  // Columns are 2 degrees wide here, and half a one from the seam: one fades into the other there.
  EXPECT_GE(joined.row(quarter)[quarter], 150);
  EXPECT_LE(joined.row(quarter)[quarter - 1], 150);
  EXPECT_LT(joined.row(quarter)[quarter - 1], joined.row(quarter)[quarter]);
}

TEST(Stitch, LensesSeeFromTheirOwnPlaces) {
  SequenceSpec spec;
  spec.num_frames = 4;
  spec.chain = mono_chain(named_camera("equirectangular", kHeightPx));
  const Image whole = SimulatedSequence(spec).frame(1).images[0];
  spec.stitched_m = 0.3;
  SimulatedSequence stitched(spec);
  const Image image = stitched.frame(1).images[0];
  ThreadPool pool(1);
  const Renderer renderer(make_world(spec.world, spec.seed), stitched.rig().cameras[0].camera);
  for (const double ahead_m : {0.15, -0.15}) {
    const Rigid3 cam_from_lens(Eigen::Quaterniond::Identity(), {0.0, 0.0, ahead_m});
    const Image seen = renderer.image(stitched.world_from_rig(1) * cam_from_lens, pool);
    const int x = ahead_m > 0.0 ? kHeightPx : 3;
    for (int y = 10; y < kHeightPx - 10; ++y) EXPECT_EQ(image.row(y)[x], seen.row(y)[x]);
  }
  EXPECT_NE(image.values, whole.values);
}

TEST(Stitch, WantsACameraThatSeesAllRound) {
  SequenceSpec spec;
  spec.stitched_m = 0.05;
  spec.chain = mono_chain(named_camera("fisheye", kHeightPx));
  EXPECT_THROW(SimulatedSequence{spec}, InputError);
}

}  // namespace
}  // namespace waymark
