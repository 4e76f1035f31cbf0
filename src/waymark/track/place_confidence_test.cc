// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/place_confidence.h"

#include <gtest/gtest.h>

#include <functional>

#include "waymark/track/testing/map.h"

namespace waymark {
namespace {

/// A keyframe, and a view of what it sees.
class PlaceConfidenceTest : public ::testing::Test {
 protected:
  PlaceConfidenceTest() : scene_(1, cloud_ahead(), {.seed = 5}, true) {
    scene_.add_keyframe(pose_at(0.0));
    view_ = scene_.look(truth_, 100);
  }

  /// Confidence if only those features had been matched that are kept.
  double confidence(const std::function<bool(std::size_t)>& is_kept) const {
    std::vector<LandmarkId> landmarks = scene_.true_associations(view_);
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      if (!is_kept(i)) landmarks[i] = LandmarkId{};
    }
    return place_confidence(
        *view_.features, landmarks, scene_.map, KeyframeId{0}, truth_.inverse());
  }

  const Rigid3 truth_ = pose_at(0.4, 0.1, 0.3, 0.05);
  TestMap scene_;
  PointObservation view_;
};

TEST_F(PlaceConfidenceTest, IsHighWhereNearlyAllIsFound) {
  const double all = confidence([](std::size_t) { return true; });
  EXPECT_GT(all, 0.8);  // Each tenth feature is missed.
  EXPECT_LE(all, 1.0);
}

TEST_F(PlaceConfidenceTest, IsZeroWhereNothingIs) {
  EXPECT_EQ(confidence([](std::size_t) { return false; }), 0.0);
}

TEST_F(PlaceConfidenceTest, PrefersFewEverywhereToManyInOneCorner) {
  const double all = confidence([](std::size_t) { return true; });
  const double thinned = confidence([](std::size_t i) { return i % 4 == 0; });
  const double corner = confidence([this](std::size_t i) {
    const Keypoint& keypoint = view_.features->keypoints[i];
    return keypoint.x_px < 320.0f && keypoint.y_px < 240.0f;
  });
  EXPECT_GT(thinned, 0.15 * all);
  EXPECT_LT(corner, 0.5 * thinned);
}

TEST_F(PlaceConfidenceTest, ExpectsOnlyWhatTheCameraCouldSee) {
  // Half turned away, it sees half of the keyframe's landmarks, but those it sees.
  const Rigid3 turned = pose_at(0.0, 0.0, 0.0, 0.6);
  const PointObservation view = scene_.look(turned, 101);
  const std::vector<LandmarkId> landmarks = scene_.true_associations(view);
  const auto keyframe = KeyframeId{0};
  const double there =
      place_confidence(*view.features, landmarks, scene_.map, keyframe, turned.inverse());
  EXPECT_GT(there, 0.7);
  const Rigid3 behind = pose_at(0.0, 0.0, 15.0, 3.14159);  // Sees only what nobody saw from there.
  EXPECT_EQ(place_confidence(*view.features, landmarks, scene_.map, keyframe, behind.inverse()),
            0.0);
}

std::shared_ptr<const Features> with_edges(const Features& features) {
  auto changed = std::make_shared<Features>(features);
  changed->num_edges = features.num_primary / 2;
  return changed;
}

TEST_F(PlaceConfidenceTest, RestsOnCorners) {
  const Keyframe& keyframe = scene_.map.keyframes().at(KeyframeId{0});
  scene_.map.recompute_keyframe(KeyframeId{0}, with_edges(*keyframe.features));
  view_.features = with_edges(*view_.features);
  const std::size_t num_corners = view_.features->num_corners();
  EXPECT_GT(confidence([&](std::size_t i) { return i < num_corners; }), 0.8);
  EXPECT_EQ(confidence([&](std::size_t i) { return i >= num_corners; }), 0.0);
}

}  // namespace
}  // namespace waymark
