// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/survey.h"

#include <gmock/gmock.h>

#include <cmath>
#include <deque>
#include <vector>

#include "waymark/marker/testing/observations.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::make_observation;

constexpr double kNoisePx = 0.2;

/// Cameras on an arc before a wall at z = 3, which look at it; markers hang there.
class Scene {
 public:
  /// unit: metres per unit of the map.
  explicit Scene(double unit = 1.0) : unit_(unit) {}

  static Rigid3 hung(double x, double y) {
    // Upright, its front to the cameras.
    const Eigen::Quaterniond facing(Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX()));
    return {facing, {x, y, 3.0}};
  }
  static Rigid3 camera(int k) {
    const double angle = 0.08 * (k - 6);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()));
    return Rigid3(turn, {2.0 * std::sin(angle), 0.05 * k, 0.3 * std::cos(angle)}).inverse();
  }

  /// Seen from cameras first to end - 1.
  std::vector<MarkerView> views(
      int id, const Rigid3& world_from_marker, double side, int first = 0, int end = 12) {
    std::vector<MarkerView> views;
    for (int k = first; k < end; ++k) {
      const auto stream = static_cast<std::uint64_t>(100 * id + k);
      observations_.push_back(
          make_observation(id, camera(k) * world_from_marker, side, kNoisePx, stream));
      Rigid3 cam_from_map = camera(k);
      cam_from_map.translation /= unit_;
      views.push_back({cam_from_map, 1'000'000'000LL * k, &observations_.back()});
    }
    return views;
  }

  SurveyedMarker survey(int id, const Rigid3& world_from_marker, double side) {
    return survey_marker(id, views(id, world_from_marker, side));
  }

 private:
  double unit_;
  std::deque<MarkerObservation> observations_;
};

TEST(SurveyMarkerTest, FindsPoseAndSizeInUnitsOfTheMap) {
  Scene scene(2.5);
  const Rigid3 truth = Scene::hung(0.4, 0.1);
  const SurveyedMarker marker = scene.survey(3, truth, 0.2);
  EXPECT_EQ(marker.verdict, MarkerStatus::kSound);
  EXPECT_EQ(marker.num_fitting, 12u);
  EXPECT_NEAR(2.5 * marker.map_from_marker.scale, 0.2, 0.2 * 0.005);
  EXPECT_LT((2.5 * marker.map_from_marker.translation - truth.translation).norm(), 0.005);
  EXPECT_LT(marker.map_from_marker.rotation.angularDistance(truth.rotation), 0.02);
  EXPECT_LT(std::abs(2.5 * marker.map_from_marker.scale / 0.2 - 1.0), 4.0 * marker.side_sigma);
}

TEST(SurveyMarkerTest, LeavesOutViewsThatAreWrong) {
  Scene scene;
  std::vector<MarkerView> views = scene.views(3, Scene::hung(0.4, 0.1), 0.2);
  views[4].cam_from_map.translation.x() += 0.3;
  const SurveyedMarker marker = survey_marker(3, views);
  EXPECT_EQ(marker.verdict, MarkerStatus::kSound);
  EXPECT_EQ(marker.num_fitting, 11u);
}

TEST(SurveyMarkerTest, OneSmallSquareSeenFromOnePlaceStaysAmbiguous) {
  std::deque<MarkerObservation> observations;
  std::vector<MarkerView> views;
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(EIGEN_PI - 0.4, Eigen::Vector3d::UnitX()));
  for (int k = 0; k < 4; ++k) {
    const Rigid3 camera(Eigen::Quaterniond::Identity(), {0.03 * k, 0.0, 0.0});
    observations.push_back(make_observation(1,
                                            camera * Rigid3(tilt, {0.0, 0.0, 6.0}),
                                            0.12,
                                            kNoisePx,
                                            7 + static_cast<std::uint64_t>(k)));
    views.push_back({camera, k, &observations.back()});
  }
  EXPECT_EQ(survey_marker(1, views).verdict, MarkerStatus::kFewViews);
}

TEST(SurveyMarkerTest, SeesThatAMarkerWasMoved) {
  Scene scene;
  std::vector<MarkerView> views = scene.views(3, Scene::hung(0.4, 0.1), 0.2, 0, 7);
  for (const MarkerView& view : scene.views(3, Scene::hung(-0.3, 0.2), 0.2, 7, 12))
    views.push_back(view);
  const SurveyedMarker marker = survey_marker(3, views);
  EXPECT_EQ(marker.verdict, MarkerStatus::kMoved);
  EXPECT_EQ(marker.changed_ns, 7'000'000'000);
  EXPECT_THAT(describe_fault(marker),
              HasSubstr("marker 3: was moved, it is elsewhere from 7.000 s on"));
}

TEST(SurveyMarkerTest, SeesThatAMarkerIsThereTwice) {
  Scene scene;
  const auto here = scene.views(3, Scene::hung(0.4, 0.1), 0.2);
  const auto there = scene.views(3, Scene::hung(-0.3, 0.2), 0.2);
  std::vector<MarkerView> in_turn;
  std::vector<MarkerView> at_once;
  for (std::size_t k = 0; k < 12; ++k) {
    in_turn.push_back((k / 2) % 2 == 0 ? here[k] : there[k]);
    at_once.push_back(here[k]);
    if (k == 5) at_once.push_back(there[k]);
  }
  EXPECT_EQ(survey_marker(3, in_turn).verdict, MarkerStatus::kTwice);
  EXPECT_EQ(survey_marker(3, at_once).verdict, MarkerStatus::kTwice);
  EXPECT_THAT(describe_fault(survey_marker(3, at_once)), HasSubstr("is there twice"));
}

/// Both cameras of a pair see the same moments: those are no more keyframes.
TEST(SurveyMarkerTest, ImagesOfAPairCountOnce) {
  Scene scene;
  const Rigid3 truth = Scene::hung(0.4, 0.1);
  std::deque<MarkerObservation> right;
  std::vector<MarkerView> views;
  for (const MarkerView& left : scene.views(3, truth, 0.2)) {
    views.push_back(left);
    const Rigid3 right_from_map =
        Rigid3(Eigen::Quaterniond::Identity(), {-0.1, 0.0, 0.0}) * left.cam_from_map;
    right.push_back(make_observation(3, right_from_map * truth, 0.2, kNoisePx, 50 + right.size()));
    right.back().camera = 1;
    views.push_back({right_from_map, left.timestamp_ns, &right.back()});
  }
  const SurveyedMarker marker = survey_marker(3, views);
  EXPECT_EQ(marker.verdict, MarkerStatus::kSound);
  EXPECT_EQ(marker.num_views, 12u);
  EXPECT_EQ(marker.num_fitting, 12u);
  EXPECT_EQ(survey_marker(3, std::span(views).first(4)).verdict, MarkerStatus::kFewViews);
}

KnownMarkers six_of(double size_m) {
  KnownMarkers known;
  known.family = "tag36h11";
  known.size_m = size_m;
  return known;
}

std::vector<SurveyedMarker> survey_six(Scene& scene, double side_of_2) {
  std::vector<SurveyedMarker> markers;
  for (int id = 0; id < 6; ++id) {
    markers.push_back(
        scene.survey(id, Scene::hung(0.5 * id - 1.2, 0.2 * (id % 2)), id == 2 ? side_of_2 : 0.2));
  }
  return markers;
}

TEST(MarkerFrameTest, IsThatOfMarker0InMetres) {
  Scene scene(2.5);
  std::vector<SurveyedMarker> markers = survey_six(scene, 0.2);
  const auto frame = fit_marker_frame(six_of(0.2), false, markers);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->basis, MarkerFrame::Basis::kMarker0);
  EXPECT_NEAR(frame->world_from_map.scale, 2.5, 2.5 * 0.005);
  EXPECT_LT((frame->world_from_map * markers[0].map_from_marker.translation).norm(), 1e-6);
  const Eigen::Vector3d other = frame->world_from_map * markers[3].map_from_marker.translation;
  EXPECT_LT((other - Eigen::Vector3d(1.5, -0.2, 0.0)).norm(), 0.03);
  for (const SurveyedMarker& marker : markers) EXPECT_THAT(describe_fault(marker), IsEmpty());
}

TEST(MarkerFrameTest, LeavesOutTheOneOfSixWhoseSizeIsWrong) {
  Scene scene(2.5);
  std::vector<SurveyedMarker> markers = survey_six(scene, 0.25);
  const auto frame = fit_marker_frame(six_of(0.2), false, markers);
  ASSERT_TRUE(frame);
  EXPECT_NEAR(frame->world_from_map.scale, 2.5, 2.5 * 0.005);
  EXPECT_EQ(markers[2].verdict, MarkerStatus::kWrongSize);
  EXPECT_NEAR(markers[2].found, 0.25, 0.002);
  EXPECT_THAT(describe_fault(markers[2]), HasSubstr("m by the others, 0.2000 m was said"));
  EXPECT_EQ(markers[3].verdict, MarkerStatus::kSound);
}

TEST(MarkerFrameTest, TwoThatContradictEachOtherTellNoScale) {
  Scene scene(2.5);
  std::vector<SurveyedMarker> markers = survey_six(scene, 0.25);
  const std::span<SurveyedMarker> two = std::span(markers).subspan(1, 2);
  EXPECT_FALSE(fit_marker_frame(six_of(0.2), false, two));
  EXPECT_THAT(describe_fault(two[0]), HasSubstr("contradict each other"));
}

TEST(MarkerFrameTest, AMapInMetresKeepsItsScaleAndJudgesSizes) {
  Scene scene;
  std::vector<SurveyedMarker> markers = {scene.survey(4, Scene::hung(0.0, 0.0), 0.25)};
  fit_marker_frame(six_of(0.2), true, markers);
  EXPECT_EQ(markers[0].verdict, MarkerStatus::kWrongSize);
  markers = {scene.survey(4, Scene::hung(0.0, 0.0), 0.2)};
  ASSERT_TRUE(fit_marker_frame(six_of(0.2), true, markers));
  EXPECT_EQ(markers[0].verdict, MarkerStatus::kSound);
}

TEST(MarkerFrameTest, SurveyedMarkersDefineTheFrameAndAMisplacedOneIsLeftOut) {
  Scene scene(2.5);
  std::vector<SurveyedMarker> markers = survey_six(scene, 0.2);
  KnownMarkers known = six_of(0.2);
  const Rigid3 site_from_world = Rigid3::exp((Vector6d() << 5, -3, 1, 0.3, -0.8, 2.0).finished());
  for (int id = 0; id < 5; ++id) {
    known.by_id[id].world_from_marker =
        site_from_world * Scene::hung(0.5 * id - 1.2, 0.2 * (id % 2));
  }
  known.by_id[3].world_from_marker->translation.x() += 0.4;
  const auto frame = fit_marker_frame(known, false, markers);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->basis, MarkerFrame::Basis::kSurvey);
  EXPECT_NEAR(frame->world_from_map.scale, 2.5, 2.5 * 0.005);
  EXPECT_LT(frame->rms_m, 0.02);
  const Rigid3 there = site_from_world * Scene::camera(5).inverse();
  EXPECT_LT(
      (frame->world_from_map * (Scene::camera(5).inverse().translation / 2.5) - there.translation)
          .norm(),
      0.03);
  EXPECT_EQ(markers[3].verdict, MarkerStatus::kMisplaced);
  EXPECT_NEAR(markers[3].found, 0.4, 0.03);
}

}  // namespace
}  // namespace waymark
