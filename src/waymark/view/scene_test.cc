// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/scene.h"

#include <gmock/gmock.h>

#include "waymark/base/rng.h"
#include "waymark/map/testing/random_map.h"
#include "waymark/view/testing/messages.h"

namespace waymark {
namespace {

template <class Id, class T>
std::vector<Id> ids_of(const CopyOnWriteTable<Id, T>& table) {
  std::vector<Id> ids;
  table.for_each([&](Id id, const T&) { ids.push_back(id); });
  return ids;
}

/// Keyframes without edges are told or not: it means the same.
Page normalized(Page page) {
  std::erase_if(page.edges, [](const auto& entry) { return entry.second.empty(); });
  return page;
}

/// A session that changes in every way between two updates.
class ChangingSession {
 public:
  explicit ChangingSession(std::uint64_t seed)
      : start_(seed, 300), map_(start_.map()), rng_(seed, 1) {}

  ViewUpdate next() {
    for (int i = 0; i < 25; ++i) edit();
    ViewUpdate update;
    update.map = map_.freeze();
    for (int i = 0; i < 4; ++i) update.frames.push_back(note_frame());
    if (num_frames_ > 10) update.frames.push_back(fill_frame());
    return update;
  }

  Map& map() { return map_; }

 private:
  template <class Id>
  Id pick(const std::vector<Id>& ids) {
    return ids[rng_.below(static_cast<std::uint32_t>(ids.size()))];
  }

  bool may_erase(KeyframeId id) const {
    return map_.keyframes().at(id).parent.is_valid() && !map_.has_loop_edge(id);
  }

  void edit() {
    const auto keyframes = ids_of(map_.keyframes());
    const auto landmarks = ids_of(map_.landmarks());
    const KeyframeId keyframe = pick(keyframes);
    const Keyframe& chosen = map_.keyframes().at(keyframe);
    const Eigen::Vector3d point(rng_.normal(), rng_.normal(), rng_.normal());
    switch (rng_.below(10)) {
      case 0:
        map_.move_keyframe(keyframe, Rigid3(chosen.rig_from_world.rotation, point));
        break;
      case 1:
        map_.move_landmark(pick(landmarks), point);
        break;
      case 2:
        map_.erase_landmark(pick(landmarks));
        break;
      case 3:
        if (may_erase(keyframe)) map_.erase_keyframe(keyframe);
        break;
      case 4:
        map_.rescale_keyframe(keyframe, 1.1);
        break;
      case 5: {
        Keyframe added = chosen;
        added.parent = keyframe;
        added.frame = FrameId{1000 + num_frames_};
        added.landmarks.assign(added.landmarks.size(), LandmarkId{});
        map_.add_keyframe(std::move(added));
        break;
      }
      case 6: {
        const LandmarkId landmark = pick(landmarks);
        Appearance appearance = map_.landmarks().at(landmark).appearance;
        appearance.across = rng_.below(3) == 0 ? Eigen::Vector3d::Zero() : point.normalized();
        map_.set_appearance(landmark, appearance);
        break;
      }
      case 7:
        if (chosen.parent.is_valid()) hang(static_cast<int>(rng_.below(5)), keyframe);
        break;
      default:
        observe(keyframe, point);
    }
  }

  /// A marker before a keyframe, in place of another one of this number.
  void hang(int id, KeyframeId keyframe) {
    std::vector<MapMarker> markers = map_.markers();
    std::erase_if(markers, [id](const MapMarker& marker) { return marker.id == id; });
    MapMarker marker;
    marker.id = id;
    marker.side_m = 0.2;
    marker.reference = keyframe;
    marker.reference_scale = map_.keyframes().at(keyframe).applied_scale;
    marker.marker_from_reference = Rigid3({1, 0, 0, 0}, {0.1, 0.2, -1.0});
    markers.push_back(marker);
    map_.set_markers(std::move(markers));
  }

  /// Many new landmarks that two keyframes share, so that they get an edge.
  void observe(KeyframeId keyframe, const Eigen::Vector3d& point) {
    const Keyframe& first = map_.keyframes().at(keyframe);
    KeyframeId other = first.parent;
    for (std::uint32_t feature = 0; feature < first.features->num_primary; ++feature) {
      if (map_.keyframes().at(keyframe).landmarks[feature].is_valid()) continue;
      const LandmarkId id = map_.add_landmark(first.submap, point, keyframe);
      map_.observe(keyframe, feature, id);
      if (!other.is_valid()) continue;
      if (!map_.keyframes().at(other).landmarks[feature].is_valid()) {
        map_.observe(other, feature, id);
      }
    }
  }

  FrameSummary note_frame() {
    FrameSummary note;
    note.frame = FrameId{num_frames_};
    note.timestamp_ns = 1'000'000'000 + num_frames_ * std::int64_t{50'000'000};
    note.tracking_ms = 12.5f;
    ++num_frames_;
    if (rng_.below(4) == 0) {
      note.reason = FrameReason::kTooFewMatches;
      return note;
    }
    note.state = FrameState::kTracked;
    note.pose = some_pose();
    return note;
  }

  FrameSummary fill_frame() {
    FrameSummary note;
    note.frame = FrameId{rng_.below(num_frames_)};
    note.timestamp_ns = 1'000'000'000 + note.frame.value * std::int64_t{50'000'000};
    note.state = FrameState::kFilled;
    note.pose = some_pose();
    return note;
  }

  /// By any keyframe that lives or lived.
  RelativePose some_pose() {
    const KeyframeId living = pick(ids_of(map_.keyframes()));
    return {
        living, map_.keyframes().at(living).applied_scale, Rigid3({1, 0, 0, 0}, {0.1, 0.2, 0.3})};
  }

  testing::RandomMap start_;
  Map& map_;
  Rng rng_;
  std::uint32_t num_frames_ = 0;
};

void apply_all(const std::vector<Message>& messages, Page& page) {
  for (const Message& message : messages) page.apply(message);
}

class SceneChanges : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SceneChanges, GiveWhatASnapshotGives) {
  ChangingSession session(GetParam());
  Scene scene;
  ViewUpdate first = session.next();
  scene.advance(first, false);
  Page follower;
  apply_all(scene.snapshot(), follower);
  for (int round = 0; round < 25; ++round) {
    ViewUpdate update = session.next();
    apply_all(scene.advance(update, true), follower);
    Page late;
    apply_all(scene.snapshot(), late);
    ASSERT_TRUE(late.is_complete);
    ASSERT_EQ(late.landmarks.size(), session.map().landmarks().size());
    ASSERT_EQ(late.keyframes.size(), session.map().keyframes().size());
    ASSERT_EQ(normalized(follower), normalized(late)) << "round " << round;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, SceneChanges, ::testing::Values(1, 2, 3, 4));

TEST(Scene, TellsTheMapAsItIs) {
  testing::RandomMap random(7);
  Scene scene;
  ViewUpdate update;
  update.map = random.map().freeze();
  scene.advance(update, false);
  Page page;
  apply_all(scene.snapshot(), page);
  const Map& map = *update.map;
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    const Page::Values& values = page.landmarks.at(id.value);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(values[i], static_cast<float>(landmark.position_in_world[i]));
    }
    EXPECT_EQ(values[4], static_cast<double>(num_observers(landmark)));
    EXPECT_EQ(values[5], landmark.submap.value);
    EXPECT_EQ(values[9], 0);  // No colour is known.
  });
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const Page::Values& values = page.keyframes.at(id.value);
    const Rigid3 world_from_rig = keyframe.rig_from_world.inverse();
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(values[i], world_from_rig.translation[i], 1e-5);
    for (int i = 0; i < 4; ++i)
      EXPECT_NEAR(values[3 + i], world_from_rig.rotation.coeffs()[i], 1e-6);
    EXPECT_EQ(values[7], keyframe.frame.value);
    EXPECT_EQ(values[9], keyframe.parent.value);
    EXPECT_EQ(values[12], keyframe.submap.value);
  });
  EXPECT_EQ(page.loops.size(), 2 * map.measured_loop_edges().size());
  EXPECT_EQ(page.submaps.size(), 2 * map.submaps().size());
}

TEST(Scene, TellsMarkersAndPointsOnEdges) {
  testing::RandomMap random(7);
  Map& map = random.map();
  const KeyframeId keyframe = ids_of(map.keyframes()).front();
  const LandmarkId landmark = ids_of(map.landmarks()).front();
  Appearance appearance;
  appearance.direction = {0.0, 0.0, -1.0};
  appearance.across = {1.0, 0.0, 0.0};
  appearance.size_m = 0.01;
  map.set_appearance(landmark, appearance);
  MapMarker marker;
  marker.id = 17;
  marker.side_m = 0.5;
  marker.reference = keyframe;
  const Keyframe reference = map.keyframes().at(keyframe);  // Also after freeze().
  marker.reference_scale = reference.applied_scale;
  // At the origin of the world, upright.
  marker.marker_from_reference = reference.rig_from_world.inverse();
  marker.surveyed_world_from_marker = Rigid3();
  map.set_markers({marker});
  Scene scene;
  ViewUpdate update;
  update.map = map.freeze();
  scene.advance(update, false);
  Page page;
  apply_all(scene.snapshot(), page);
  const Page::Values expected = {17,
                                 -.25,
                                 .25,
                                 0,
                                 .25,
                                 .25,
                                 0,
                                 .25,
                                 -.25,
                                 0,
                                 -.25,
                                 -.25,
                                 0,
                                 1,
                                 double(reference.submap.value)};
  ASSERT_EQ(page.markers.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(page.markers[i], expected[i], 1e-6) << i;
  }
  const Page::Values& half = page.on_edges.at(landmark.value);
  EXPECT_NEAR(std::abs(half[1]), 0.05, 1e-6);  // Five pixels, along y.
  EXPECT_NEAR(half[0], 0.0, 1e-6);
  EXPECT_NEAR(half[2], 0.0, 1e-6);
}

TEST(Scene, GivesLandmarksTheColorOfTheirFeature) {
  testing::RandomMap random(8);
  Map& map = random.map();
  const KeyframeId keyframe = ids_of(map.keyframes()).front();
  std::uint32_t feature = 0;
  while (map.keyframes().at(keyframe).landmarks[feature].is_valid()) ++feature;
  Scene scene;
  ViewUpdate before;
  before.map = map.freeze();
  scene.advance(before, false);

  ViewUpdate after;
  FeatureColors colors;
  colors.frame = map.keyframes().at(keyframe).frame;
  colors.rgb.assign(map.keyframes().at(keyframe).features->num_primary, {1, 2, 3});
  colors.rgb[feature] = {10, 20, 30};
  after.colors.push_back(colors);
  const LandmarkId id = map.add_landmark(map.keyframes().at(keyframe).submap, {1, 2, 3}, keyframe);
  map.observe(keyframe, feature, id);
  after.map = map.freeze();
  Page page;
  apply_all(scene.advance(after, true), page);
  const Page::Values& values = page.landmarks.at(id.value);
  EXPECT_THAT(Page::Values(values.begin() + 6, values.end()),
              ::testing::ElementsAre(10, 20, 30, 255));
}

/// A frame each 50 ms that goes .1 m along x.
FrameSummary moving_frame(std::uint32_t number, KeyframeId reference) {
  FrameSummary note;
  note.state = FrameState::kTracked;
  note.frame = FrameId{number};
  note.timestamp_ns = 50'000'000 * std::int64_t{number};
  note.pose = RelativePose{reference, 1.0, {}};
  note.pose->rig_from_reference.translation.x() = -0.1 * number;
  return note;
}

TEST(Scene, TellsTheVelocityWhereTheMapIsMetric) {
  for (const bool is_metric : {true, false}) {
    Map map;
    Keyframe keyframe;
    keyframe.submap = map.add_submap(is_metric);
    const auto features = std::make_shared<Features>();
    features->rig = std::make_shared<const Rig>();
    keyframe.features = features;
    const KeyframeId id = map.add_keyframe(keyframe);
    Scene scene;
    ViewUpdate update;
    update.map = map.freeze();
    for (std::uint32_t i = 0; i < 10; ++i) update.frames.push_back(moving_frame(i, id));
    update.frames[2].pose->rig_from_reference.translation.y() = 7.0;  // Too long ago to matter.
    scene.advance(update, true);
    ASSERT_EQ(scene.velocity().has_value(), is_metric);
    EXPECT_TRUE(scene.velocity(keyframe.submap)) << "an IMU told the metres";
    if (!is_metric) continue;
    EXPECT_LT((*scene.velocity() - Eigen::Vector3d(2.0, 0.0, 0.0)).norm(), 1e-9);
    update.frames = {moving_frame(10, KeyframeId{id.value + 1})};
    scene.advance(update, true);
    EXPECT_TRUE(scene.velocity()) << "the keyframe of the newest is on its way to the map";
    update.frames = {moving_frame(11, id)};
    update.frames[0].pose.reset();
    scene.advance(update, true);
    EXPECT_FALSE(scene.velocity()) << "the camera is lost";
  }
}

TEST(Scene, AResetForgetsEverything) {
  ChangingSession session(5);
  Scene scene;
  ViewUpdate update = session.next();
  scene.advance(update, false);
  Page page;
  apply_all(scene.snapshot(), page);
  EXPECT_FALSE(page.landmarks.empty());
  ViewUpdate reset;
  reset.is_reset = true;
  reset.map = std::make_shared<const Map>();
  apply_all(scene.advance(reset, true), page);
  EXPECT_TRUE(page.is_complete);
  EXPECT_TRUE(page.landmarks.empty() && page.keyframes.empty() && page.frames.empty());
}

}  // namespace
}  // namespace waymark
