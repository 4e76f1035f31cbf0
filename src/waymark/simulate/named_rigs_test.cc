// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/named_rigs.h"

#include <gtest/gtest.h>

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

/// Where a camera looks from the rig's point of view: degrees to the right of ahead.
double right_deg(const ChainCamera& camera) {
  const Eigen::Vector3d looks = camera.cam_from_rig.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(looks.y(), 0.0, 1e-12);
  return std::atan2(looks.x(), looks.z()) * 180.0 / M_PI;
}

TEST(NamedRigs, CamerasLookAwayFromWhereTheOthersAre) {
  for (const std::string& name : rig_names()) {
    const CameraChain chain = named_rig(name, 120);
    ASSERT_GE(chain.cameras.size(), 2u) << name;
    EXPECT_EQ(chain.cameras[0].cam_from_rig.matrix(), Eigen::Matrix4d::Identity()) << name;
    for (const ChainCamera& camera : chain.cameras) {
      const Eigen::Vector3d place = camera.cam_from_rig.origin_in_source();
      // Nobody sees another one of the rig straight ahead.
      for (const ChainCamera& other : chain.cameras) {
        const Eigen::Vector3d towards = camera.cam_from_rig * other.cam_from_rig.origin_in_source();
        EXPECT_LT(towards.z(), 0.5 * towards.norm() + 1e-12) << name;
      }
      EXPECT_LT(place.norm(), 2.5) << name;
    }
  }
}

TEST(NamedRigs, FaceTheFourSidesOrBothEnds) {
  const CameraChain surround = named_rig("surround", 120);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(
        std::remainder(right_deg(surround.cameras[i]) - 90.0 * static_cast<double>(i), 360.0),
        0.0,
        1e-9)
        << i;
  }
  const CameraChain back_to_back = named_rig("back_to_back", 120);
  EXPECT_NEAR(std::abs(right_deg(back_to_back.cameras[1])), 180.0, 1e-9);
  EXPECT_NEAR(back_to_back.cameras[1].cam_from_rig.origin_in_source().z(), -0.03, 1e-12);
}

TEST(NamedRigs, UnknownOnesAreNamed) { EXPECT_THROW(named_rig("octopus", 120), InputError); }

/// The surround rig; images are small.
SequenceSpec surround_spec() {
  SequenceSpec spec;
  spec.chain = named_rig("surround", 60);
  spec.num_frames = 4;
  return spec;
}

TEST(NamedRigs, CamerasThatAreNotTriggeredTogetherSeeFromWhereTheyAreByThen) {
  SequenceSpec spec = surround_spec();
  spec.rate_hz = 10.0;
  spec.trigger_lag_s = 0.025;
  SimulatedSequence lagging(spec);
  const SimulatedFrame frame = lagging.frame(1);
  ASSERT_EQ(frame.image_timestamps_ns.size(), 4u);
  EXPECT_EQ(frame.image_timestamps_ns[0], frame.timestamp_ns);
  EXPECT_EQ(frame.image_timestamps_ns[2], frame.timestamp_ns + 50'000'000);
  // Camera 2 is half a frame late: it sees what it would in the frame between of one twice as fast.
  spec.trigger_lag_s = 0.0;
  spec.rate_hz = 20.0;
  spec.num_frames = 8;
  SimulatedSequence between(spec);
  EXPECT_EQ(frame.images[2].values, between.frame(3).images[2].values);
  EXPECT_NE(frame.images[1].values, between.frame(3).images[1].values);
}

TEST(NamedRigs, OneCameraMayBeDarkByItself) {
  SequenceSpec spec = surround_spec();
  ImageEffects black;
  black.gain = 0.0;
  spec.spans = {{1, 3, black, 2}};
  SimulatedSequence sequence(spec);
  for (const int index : {0, 1, 2, 3}) {
    const SimulatedFrame frame = sequence.frame(index);
    for (std::size_t camera = 0; camera < 4; ++camera) {
      int brightest = 0;
      for (const std::uint8_t value : frame.images[camera].values) {
        brightest = std::max(brightest, static_cast<int>(value));
      }
      const bool is_dark = camera == 2 && index >= 1 && index < 3;
      EXPECT_EQ(brightest < 30, is_dark) << index << ' ' << camera;
    }
  }
}

}  // namespace
}  // namespace waymark
