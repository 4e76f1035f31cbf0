// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/triangulate_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "waymark/features/feature_geometry.h"
#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// An upright line in the world.
struct UprightLine {
  double x, z;
  bool is_lighter_left;
};

/// Keyframes in a row that see points of upright lines, each in other places, and one landmark in
/// common.
class TriangulateEdges : public ::testing::Test {
 protected:
  explicit TriangulateEdges(double step_m = 0.12) {
    submap_ = map_.add_submap(false);
    for (int i = 0; i < 7; ++i) add_keyframe(pose_at(step_m * i, 0.02 * (i % 3)));
    common_ = map_.add_landmark(submap_, {0.0, 0.0, 4.0}, newest_);
    for (std::uint32_t i = 0; i < 7; ++i) map_.observe(KeyframeId{i}, 0, common_);
  }

  Keypoint seen(const Rigid3& rig_from_world, const Eigen::Vector3d& point, float angle_rad) {
    const Eigen::Vector3d in_cam = rig_from_world * point;
    return {.x_px = static_cast<float>(420.0 * in_cam.x() / in_cam.z() + 319.5 +
                                       rng_.uniform(-0.3, 0.3)),
            .y_px = static_cast<float>(420.0 * in_cam.y() / in_cam.z() + 239.5),
            .angle_rad = angle_rad,
            .level = 2};
  }

  void add_keyframe(const Rigid3& world_from_rig) {
    auto features = std::make_shared<Features>();
    features->rig = rig_;
    const Rigid3 rig_from_world = world_from_rig.inverse();
    features->keypoints.push_back(seen(rig_from_world, {0.0, 0.0, 4.0}, 0.0f));
    for (const UprightLine& line : lines_) {
      for (double y = -1.0; y < 1.0; y += 0.06) {
        const float angle_rad = line.is_lighter_left ? std::numbers::pi_v<float> : 0.0f;
        features->keypoints.push_back(
            seen(rig_from_world, {line.x, y + rng_.uniform(-0.02, 0.02), line.z}, angle_rad));
      }
    }
    features->num_primary = features->size();
    features->num_edges = features->size() - 1;
    features->descriptors.resize(features->size());
    features->partner.assign(features->size(), kNoFeature);
    features->range_m = features->inverse_range_sigma = FeatureArray<float>(features->size(), 0.0f);
    derive_geometry(*rig_, *features);
    Keyframe keyframe;
    keyframe.frame = FrameId{static_cast<std::uint32_t>(map_.keyframes().size())};
    keyframe.submap = submap_;
    keyframe.rig_from_world = rig_from_world;
    if (newest_.is_valid()) keyframe.parent = newest_;
    keyframe.features = features;
    newest_ = map_.add_keyframe(std::move(keyframe));
  }

  const std::vector<UprightLine> lines_ = {{-1.0, 3.0, false},
                                           {-0.9, 3.4, true},
                                           {0.3, 2.5, false},
                                           {0.8, 4.5, false},
                                           {1.2, 3.1, true}};
  const std::shared_ptr<const Rig> rig_ = make_test_rig(1);
  Rng rng_{7, 0};
  Map map_;
  SubmapId submap_;
  KeyframeId newest_;
  LandmarkId common_;
};

class TriangulateEdgesAtTheSamePlace : public TriangulateEdges {
 protected:
  TriangulateEdgesAtTheSamePlace() : TriangulateEdges(0.001) {}
};

TEST_F(TriangulateEdges, FindsPointsOnTheLines) {
  DirtyLandmarks dirty;
  triangulate_edges(map_, newest_, dirty);
  EXPECT_EQ(map_.broken_invariants(), "");
  int num_near = 0;
  int num_added = 0;
  map_.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    if (id == common_) return;
    ++num_added;
    EXPECT_GE(num_observers(landmark), 4u);
    const Eigen::Vector3d& point = landmark.position_in_world;
    num_near += std::ranges::any_of(lines_, [&](const UprightLine& line) {
      return std::hypot(point.x() - line.x, point.z() - line.z) < 0.03 * line.z;
    });
  });
  EXPECT_GT(num_added, 60);
  EXPECT_GT(num_near, 0.95 * num_added);
  EXPECT_EQ(static_cast<int>(dirty.size()), num_added);
}

TEST_F(TriangulateEdgesAtTheSamePlace, MakesNothingWithoutParallax) {
  DirtyLandmarks dirty;
  triangulate_edges(map_, newest_, dirty);
  EXPECT_TRUE(dirty.empty());
}

}  // namespace
}  // namespace waymark
