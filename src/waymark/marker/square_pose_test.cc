// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/square_pose.h"

#include <gmock/gmock.h>

#include "waymark/marker/testing/observations.h"

namespace waymark {
namespace {

using testing::look_at_marker;
using testing::make_observation;

TEST(SquarePoseTest, OneOfTheTwoPosesIsThatFromWhichItWasSeen) {
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0.1, 0.0, 1.0),
                                           Eigen::Vector3d(1.0, 0.2, -0.4),
                                           Eigen::Vector3d(0.0, -1.0, 0.01)}) {
    const Rigid3 pose = look_at_marker(direction, 1.5, 0.6, 0.3);
    const auto found = square_poses(make_observation(2, pose, 0.2), 0.2);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_LT((found[0] * pose.inverse()).log().norm(), 1e-3);
    EXPECT_LT(squared_error_px(make_observation(2, pose, 0.2), found[0], 0.2), 1e-4);
  }
}

TEST(SquarePoseTest, TheOtherPoseOfASmallMarkerFitsNearlyAsWell) {
  const Rigid3 pose = look_at_marker({0.0, 0.0, 1.0}, 8.0, 0.4, 0.0);
  const MarkerObservation observation = make_observation(2, pose, 0.2);
  const auto found = square_poses(observation, 0.2);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_GT((found[0].rotation.inverse() * found[1].rotation).vec().norm(), 0.2);
  EXPECT_LT(squared_error_px(observation, found[1], 0.2), 0.05);
}

TEST(SquarePoseTest, CornersOnALineGiveNoPoseThatIsNotFinite) {
  MarkerObservation observation =
      make_observation(2, look_at_marker({0, 0, 1}, 2.0, 0.0, 0.0), 0.2);
  for (std::size_t i = 0; i < 4; ++i) {
    observation.bearings[i] =
        Eigen::Vector3f(0.01f * static_cast<float>(i), 0.0f, 1.0f).normalized();
  }
  for (const Rigid3& pose : square_poses(observation, 0.2)) {
    EXPECT_TRUE(pose.translation.allFinite());
  }
}

}  // namespace
}  // namespace waymark
