// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/marker_bundle.h"

#include <gmock/gmock.h>

#include <memory>
#include <vector>

#include "waymark/mapping/markers.h"
#include "waymark/marker/testing/observations.h"

namespace waymark {
namespace {

constexpr double kSide = 0.2;
constexpr double kWrongScale = 1.05;

/// Cameras on a line before a marker, mapped a twentieth too large.
class MarkerBundleTest : public ::testing::Test {
 protected:
  MarkerBundleTest() {
    const SubmapId submap = map_.add_submap(false);
    auto features = std::make_shared<Features>();
    features->rig = std::make_shared<const Rig>(Rig{.cameras = {RigCamera{}}});
    for (int k = 0; k < 6; ++k) {
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1 * (k - 3), Eigen::Vector3d::UnitY()));
      const Rigid3 truth(turn, {0.3 * (3 - k), 0.02 * k, 0.0});
      Keyframe keyframe;
      keyframe.frame = FrameId{static_cast<std::uint32_t>(k)};
      keyframe.timestamp_ns = k;
      keyframe.submap = submap;
      keyframe.rig_from_world = {truth.rotation, kWrongScale * truth.translation};
      keyframe.features = features;
      if (k > 0) keyframe.parent = KeyframeId{static_cast<std::uint32_t>(k - 1)};
      keyframe.markers = std::make_shared<const MarkerObservations>(MarkerObservations{
          testing::make_observation(4, truth * hung_, kSide, 0.05, static_cast<std::uint64_t>(k))});
      keyframes_.push_back(map_.add_keyframe(std::move(keyframe)));
      truth_.push_back(truth);
    }
  }

  BundleProblem problem() const {
    BundleProblem problem;
    for (const KeyframeId id : keyframes_) {
      problem.rig_from_world.push_back(map_.keyframes().at(id).rig_from_world);
      problem.rigs.push_back(map_.keyframes().at(id).features->rig.get());
      problem.is_pose_fixed.push_back(id == keyframes_.front());
    }
    return problem;
  }

  double baseline(const std::vector<Rigid3>& rig_from_world) const {
    return (rig_from_world[5].origin_in_source() - rig_from_world[0].origin_in_source()).norm();
  }

  Map map_;
  std::vector<KeyframeId> keyframes_;
  std::vector<Rigid3> truth_;
  const Rigid3 hung_{Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), {0.0, 0.0, 2.0}};
  const KnownMarkers known_{.family = "tag36h11", .size_m = kSide, .by_id = {}};
};

TEST_F(MarkerBundleTest, AMarkerOfKnownSizeHoldsTheScale) {
  MarkerSurvey survey = survey_markers(map_, SubmapId{0}, known_);
  ASSERT_TRUE(survey.frame);
  EXPECT_NEAR(survey.frame->world_from_map.scale, 1.0 / kWrongScale, 0.003);
  note_markers(map_, SubmapId{0}, known_, survey, Sim3());
  BundleProblem adjusted = problem();
  const auto rigs = add_markers(map_, keyframes_, adjusted);
  ASSERT_EQ(rigs.size(), 1u);
  EXPECT_EQ(adjusted.points.size(), 4u);
  EXPECT_EQ(adjusted.observations.size(), 4u * 7u);
  const BundleResult result = adjust_bundle(adjusted, {.max_iterations_per_round = 50});
  EXPECT_THAT(result.is_outlier, ::testing::Each(0));
  EXPECT_NEAR(baseline(adjusted.rig_from_world) / baseline(truth_), 1.0, 0.005);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR((adjusted.points[i] - adjusted.points[(i + 1) % 4]).norm(), kSide, 1e-3 * kSide);
  }
}

TEST_F(MarkerBundleTest, PlacingPutsTheMapIntoMetres) {
  const MarkerSurvey survey = survey_markers(map_, SubmapId{0}, known_);
  ASSERT_TRUE(is_firm(survey));
  place_by_markers(map_, SubmapId{0}, known_, survey);
  std::vector<Rigid3> poses;
  for (const KeyframeId id : keyframes_) poses.push_back(map_.keyframes().at(id).rig_from_world);
  EXPECT_NEAR(baseline(poses) / baseline(truth_), 1.0, 0.005);
  ASSERT_EQ(map_.markers().size(), 1u);
  const Rigid3 rig_from_marker =
      map_.keyframes().at(keyframes_[3]).rig_from_world * map_.world_from_marker(map_.markers()[0]);
  EXPECT_LT((rig_from_marker.translation - (truth_[3] * hung_).translation).norm(), 0.02);
  EXPECT_EQ(map_.broken_invariants(), "");
}

TEST_F(MarkerBundleTest, ASurveyedMarkerStaysAndHoldsTheMap) {
  KnownMarkers known = known_;
  known.by_id[4].world_from_marker = Rigid3::exp((Vector6d() << 3, 1, 2, 0.1, 0.4, 0).finished());
  place_by_markers(map_, SubmapId{0}, known, survey_markers(map_, SubmapId{0}, known));
  EXPECT_TRUE(is_held_by_survey(map_, SubmapId{0}));
  BundleProblem adjusted = problem();
  adjusted.is_pose_fixed.assign(adjusted.is_pose_fixed.size(), 0);
  const auto rigs = add_markers(map_, keyframes_, adjusted);
  EXPECT_TRUE(adjusted.is_pose_fixed.back());
  adjust_bundle(adjusted, {.max_iterations_per_round = 50});
  const Rigid3 world_from_rig = *known.pose_of(4) * (truth_[3] * hung_).inverse();
  // One marker is all that this camera sees.
  EXPECT_LT((adjusted.rig_from_world[3].inverse().translation - world_from_rig.translation).norm(),
            0.1);
}

}  // namespace
}  // namespace waymark
