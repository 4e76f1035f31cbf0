// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "waymark/simulate/dataset.h"

namespace waymark {
namespace {

TEST(Suite, HoldsTwoOfEachKind) {
  const std::vector<SuiteEntry> suite = simulated_suite();
  ASSERT_EQ(suite.size(), 10u);
  std::set<std::string> names;
  std::multiset<std::string> setups;
  for (const SuiteEntry& entry : suite) {
    names.insert(entry.spec.name);
    setups.insert(entry.setup);
    EXPECT_EQ(entry.spec.rate_hz, 20.0);
    EXPECT_EQ(entry.setup == "rgbd", entry.spec.chain.depth_factor.has_value());
    EXPECT_EQ(entry.setup == "stereo" ? 2u : 1u, entry.spec.chain.cameras.size());
    for (const EffectSpan& span : entry.spec.spans) {
      EXPECT_LT(span.first_frame, span.end_frame);
      EXPECT_LE(span.end_frame, entry.spec.num_frames);
    }
  }
  EXPECT_EQ(names.size(), 10u);
  EXPECT_EQ(setups.count("mono"), 4u);
  EXPECT_EQ(setups.count("stereo"), 4u);
  EXPECT_EQ(setups.count("rgbd"), 2u);
}

TEST(Suite, StereoCamerasSeeTheSameThings) {
  int num_pairs = 0;
  for (const SuiteEntry& entry : simulated_suite()) {
    if (entry.setup != "stereo") continue;
    ++num_pairs;
    const Rig rig = make_rig(entry.spec.chain);
    const Rigid3 cam1_from_cam0 = rig.cameras[1].cam_from_rig;
    EXPECT_GT(cam1_from_cam0.origin_in_source().x(), 0.05) << "camera 1 is on the right";
    // What is 3 m ahead of the middle of the pair is near the middle of both images.
    const Eigen::Vector3d ahead =
        0.5 * cam1_from_cam0.origin_in_source() + Eigen::Vector3d(0, 0, 3);
    const Eigen::Vector3d in_cam1 = cam1_from_cam0 * ahead;
    EXPECT_LT(std::abs(in_cam1.x() / in_cam1.z()), 0.15) << entry.spec.name;
  }
  EXPECT_GE(num_pairs, 2);
}

}  // namespace
}  // namespace waymark
