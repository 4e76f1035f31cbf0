// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_frames.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "waymark/base/testing/errors.h"
#include "waymark/exchange/testing/small_map.h"
#include "waymark/map/align.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::small_map;

constexpr SubmapId kSubmap{0};

/// The way of small_map(), whose keyframes are a second apart from 100.5 s on, in fifths of a
/// second.
std::vector<StampedPose> whole_way() {
  std::vector<StampedPose> poses;
  for (int i = 0; i <= 10; ++i) {
    const double at = 0.2 * i;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.03 * at, Eigen::Vector3d::UnitY()));
    poses.push_back({100'500'000'000 + i * 200'000'000, {turn, {0.2 * at, 0.0, 0.05 * at}}});
  }
  return poses;
}

void expect_on_way(const std::vector<FramePlace>& places,
                   const std::vector<StampedPose>& way,
                   const Sim3& map_from_way) {
  ASSERT_EQ(places.size(), way.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(places[i].timestamp_ns, way[i].timestamp_ns);
    const Eigen::Vector3d expected = map_from_way * way[i].world_from_camera.translation;
    EXPECT_LT((places[i].rig_from_world.origin_in_source() - expected).norm(), 1e-9) << i;
  }
}

TEST(PlaceFrames, FollowsTheKeyframesWhereverTheMapWentSince) {
  const std::vector<StampedPose> way = whole_way();
  Map map = small_map("plain");
  expect_on_way(place_frames(map, kSubmap, way, "way.txt"),
                way,
                {Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), 1.0});
  const Sim3 moved{Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 2) / 3.0)),
                   {3.0, -1.0, 2.0},
                   2.5};
  transform_submap(map, kSubmap, moved);
  const std::vector<FramePlace> places = place_frames(map, kSubmap, way, "way.txt");
  expect_on_way(places, way, moved);
  EXPECT_EQ(places[2].nearest, KeyframeId{0});
  EXPECT_EQ(places[3].nearest, KeyframeId{1});
  EXPECT_EQ(places[5].nearest, KeyframeId{1});
}

TEST(PlaceFrames, RefusesTheTrajectoryOfAnotherRun) {
  const Map map = small_map("plain");
  std::vector<StampedPose> other = whole_way();
  for (std::size_t i = 0; i < other.size(); ++i) {
    other[i].world_from_camera.rotation =
        Eigen::AngleAxisd(0.1 * static_cast<double>(i), Eigen::Vector3d::UnitX());
  }
  EXPECT_THAT(testing::input_error_of([&] { place_frames(map, kSubmap, other, "other.txt"); }),
              HasSubstr("other.txt: has the keyframes of the map in other places"));
  for (StampedPose& pose : other) pose.timestamp_ns += 50'000'000'000;
  EXPECT_THAT(place_frames(map, kSubmap, other, "other.txt"), IsEmpty());
}

TEST(Sharpness, FallsWithBlur) {
  Image sharp(64, 48), blurred(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto at = static_cast<std::size_t>(64 * y + x);
      sharp.values[at] = x / 8 % 2 == 0 ? 40 : 200;
      blurred.values[at] = static_cast<std::uint8_t>(120 + 80 * std::sin(x * 3.14159 / 8));
    }
  }
  const auto measure = [](const Image& image) {
    return sharpness({image.values.data(), image.width_px, image.height_px, image.width_px});
  };
  EXPECT_GT(measure(sharp), 10.0 * measure(blurred));
  EXPECT_EQ(measure(Image(64, 48)), 0.0);
}

TEST(ChooseFrames, TakesTheSharpestOfEachPartOfTheWay) {
  const Map map = small_map("plain");
  std::vector<FramePlace> places = place_frames(map, kSubmap, whole_way(), "way.txt");
  for (const std::size_t sharp : {1u, 4u, 9u}) places[sharp].sharpness = 5.0;
  EXPECT_THAT(choose_frames(places, {FrameChoice::kSharpest, 3}, 5.0), ElementsAre(1, 4, 9));
  EXPECT_THAT(choose_frames(places, {FrameChoice::kEvery, 4}, 5.0), ElementsAre(0, 4, 8));
  EXPECT_EQ(choose_frames(places, {FrameChoice::kAll, 1}, 5.0).size(), 11u);
  EXPECT_EQ(choose_frames(places, {FrameChoice::kSharpest, 50}, 5.0).size(), 11u);
  // A camera that stands still for most of the time gets no more for that.
  for (std::size_t i = 4; i < places.size(); ++i) {
    places[i].rig_from_world = places[4].rig_from_world;
  }
  EXPECT_THAT(choose_frames(places, {FrameChoice::kSharpest, 4}, 5.0), ElementsAre(0, 1, 2, 4));
}

TEST(WithFrames, KeepsPointsAndTheFeaturesOfKeyframes) {
  const Map map = small_map("plain");
  const ExportScene scene = make_export_scene(map, kSubmap, {}, ExportCameras::kAll);
  std::vector<FramePlace> places = place_frames(map, kSubmap, whole_way(), "way.txt");
  for (std::size_t i = 0; i < places.size(); ++i) places[i].index = 7 + i;
  const std::vector<FramePlace> chosen = {places[0], places[3], places[10]};
  const ExportScene made = with_frames(scene, map, chosen);
  ASSERT_EQ(made.views.size(), 3u);
  EXPECT_EQ(made.views[1].name, "000010_101100000000.jpg");
  EXPECT_THAT(made.views[1].pixels, IsEmpty());
  EXPECT_EQ(made.views[2].pixels.size(), 31u);
  ASSERT_EQ(made.points.size(), 30u);
  for (const ExportPoint& point : made.points) {
    ASSERT_EQ(point.observations.size(), 2u);
    EXPECT_EQ(point.observations[1].view, 2u);
    EXPECT_EQ(&made.points[made.views[2].points[point.observations[1].feature]], &point);
  }
}

}  // namespace
}  // namespace waymark
