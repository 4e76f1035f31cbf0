// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Every setting, set as on the command line, changes what it says that it changes.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "waymark/base/config.h"
#include "waymark/calibration/testing/calibration.h"
#include "waymark/loop/global_mapper.h"
#include "waymark/system/testing/sequence.h"

namespace waymark {
namespace {

constexpr double kRadToDeg = 57.29577951308232;

/// The settings of the small sequence and then those given, "key=value" each.
Settings settings_with(const std::vector<std::string>& assignments) {
  Settings settings = small_settings();
  std::vector<ConfigSource> sources;
  for (const std::string& text : assignments) {
    sources.push_back(ConfigSource::from_assignment(text));
  }
  read_settings(settings, sources);
  return settings;
}

/// The features of a frame as the settings have them found.
std::shared_ptr<const Features> features_with(const std::vector<std::string>& assignments) {
  System system(small_rig(), settings_with(assignments), Timing::kInline);
  system.feed(input_of(frames()[0]));
  return system.result().features;
}

struct EffectRun {
  std::vector<TrackingResult> results;           ///< Per frame.
  std::vector<std::shared_ptr<const Map>> maps;  ///< What each frame saw.
  std::shared_ptr<const Map> map;                ///< At the end.
  std::vector<TrajectoryFrame> trajectory;

  std::vector<int> keyframes() const {
    std::vector<int> numbers;
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (results[i].is_keyframe) numbers.push_back(static_cast<int>(i));
    }
    return numbers;
  }
};

enum class Sensor { kDepth, kMono };

EffectRun play(const std::vector<std::string>& assignments, Sensor sensor = Sensor::kDepth) {
  System system(small_rig(), settings_with(assignments), Timing::kInline);
  EffectRun session;
  for (const SimulatedFrame& frame : frames()) {
    FrameImages input = input_of(frame);
    if (sensor == Sensor::kMono) input.depth = {};
    session.results.push_back(system.feed(input));
    session.maps.push_back(system.map());
  }
  system.finish();
  session.map = system.map();
  session.trajectory = system.trajectory();
  return session;
}

bool same_bits(const EffectRun& a, const EffectRun& b) {
  return std::equal(a.trajectory.begin(),
                    a.trajectory.end(),
                    b.trajectory.begin(),
                    b.trajectory.end(),
                    [](const TrajectoryFrame& x, const TrajectoryFrame& y) {
                      return x.world_from_rig.matrix() == y.world_from_rig.matrix();
                    });
}

TEST(SettingsEffect, SeedChangesWhatIsDrawn) {
  const EffectRun first = play({"seed=1"}, Sensor::kMono);
  ASSERT_GT(first.trajectory.size(), 15u);
  EXPECT_TRUE(same_bits(first, play({"seed=1"}, Sensor::kMono)));
  const bool differs = !same_bits(first, play({"seed=2"}, Sensor::kMono)) ||
                       !same_bits(first, play({"seed=3"}, Sensor::kMono));
  EXPECT_TRUE(differs);
}

TEST(SettingsEffect, MapLatencySaysWhenAKeyframeShows) {
  for (const int latency : {1, 2, 5}) {
    const EffectRun session = play({"map_latency=" + std::to_string(latency)});
    const std::vector<int> keyframes = session.keyframes();
    ASSERT_GE(keyframes.size(), 3u);
    // The first begins the map, which is needed at once.
    for (std::size_t k = 1; k < keyframes.size(); ++k) {
      const int shows = keyframes[k] + latency;
      if (shows >= kNumFrames) continue;
      const KeyframeId id{static_cast<std::uint32_t>(k)};
      EXPECT_LE(session.maps[static_cast<std::size_t>(shows - 1)]->keyframes().end_id(), id);
      EXPECT_GT(session.maps[static_cast<std::size_t>(shows)]->keyframes().end_id(), id);
    }
  }
}

TEST(SettingsEffect, FeatureCountIsThatOfAnImage) {
  EXPECT_EQ(features_with({"features.count=200"})->num_primary, 200u);
  EXPECT_EQ(features_with({"features.count=400"})->num_primary, 400u);
}

TEST(SettingsEffect, MinContrastLeavesOutWeakCorners) {
  const auto all = features_with({"features.min_contrast=5", "features.count=5000"});
  const auto strong = features_with({"features.min_contrast=60", "features.count=5000"});
  const auto num_weak = [](const Features& features) {
    return std::count_if(features.keypoints.begin(),
                         features.keypoints.end(),
                         [](const Keypoint& keypoint) { return keypoint.response <= 60.0f; });
  };
  EXPECT_GT(num_weak(*all), 0);
  EXPECT_EQ(num_weak(*strong), 0);
  EXPECT_GT(strong->num_primary, 20u);
  EXPECT_LT(strong->num_primary, all->num_primary);
}

TEST(SettingsEffect, MinRangeBaselinesLeavesOutWhatIsNear) {
  SequenceSpec spec = small_spec();
  const CameraDescription camera = spec.chain.cameras.at(0).description;
  const Rigid3 cam1_from_cam0(Eigen::Quaterniond::Identity(), {-0.1, 0.0, 0.0});
  spec.chain = stereo_chain(camera, camera, cam1_from_cam0);
  SimulatedSequence sequence(spec);
  const SimulatedFrame frame = sequence.frame(0);
  const auto num_ranges = [&](const std::string& assignment) {
    System system(sequence.rig(), settings_with({assignment}), Timing::kInline);
    FrameImages input = input_of(frame);
    input.depth = {};
    input.image1 = frame.images[1].view();
    system.feed(input);
    const FeatureArray<float>& ranges = system.result().features->range_m;
    return std::count_if(ranges.begin(), ranges.end(), [](float range) { return range > 0.0f; });
  };
  // All of the room is nearer than 200 times 0.1 m.
  const auto num_usual = num_ranges("stereo.min_range_baselines=4");
  EXPECT_GT(num_usual, 100);
  EXPECT_LT(num_ranges("stereo.min_range_baselines=200"), num_usual / 2);
}

TEST(SettingsEffect, DepthFactorIsTheUnitOfTheDepthImage) {
  const auto millimetres = features_with({"depth.factor=1000"});
  const auto half = features_with({"depth.factor=2000"});
  ASSERT_EQ(millimetres->size(), half->size());
  int num_ranges = 0;
  for (std::size_t i = 0; i < millimetres->num_primary; ++i) {
    if (millimetres->range_m[i] == 0.0f || half->range_m[i] == 0.0f) continue;
    ++num_ranges;
    EXPECT_NEAR(half->range_m[i], 0.5f * millimetres->range_m[i], 1e-4f);
  }
  EXPECT_GT(num_ranges, 100);
}

TEST(SettingsEffect, DepthOffsetIsTakenOffInverseDepths) {
  const auto plain = features_with({});
  const auto less = features_with({"depth.inverse_offset=0.02"});
  int num_ranges = 0;
  for (std::size_t i = 0; i < plain->num_primary; ++i) {
    if (plain->range_m[i] == 0.0f) continue;
    ++num_ranges;
    EXPECT_NEAR(
        1.0f / less->range_m[i], 1.0f / plain->range_m[i] - 0.02f * plain->bearings[i].z(), 1e-4f);
  }
  EXPECT_GT(num_ranges, 100);
}

TEST(SettingsEffect, DepthLagAddsToThatOfTheTimeStamps) {
  const auto ranges_m = [](const std::string& assignment, std::int64_t lag_ns) {
    System system(small_rig(), settings_with({assignment}), Timing::kInline);
    for (std::size_t i = 0; i < 3; ++i) {
      FrameImages input = input_of(frames()[i]);
      input.depth_lag_ns = lag_ns;
      system.feed(input);
    }
    return system.result().features->range_m;
  };
  const auto share_alike = [](const FeatureArray<float>& a, const FeatureArray<float>& b) {
    int num_alike = 0;
    for (std::size_t i = 0; i < a.size(); ++i) num_alike += std::abs(a[i] - b.at(i)) < 1e-4f;
    return num_alike / static_cast<double>(a.size());
  };
  const FeatureArray<float> later = ranges_m("depth.lag_ms=20", 0);
  EXPECT_GT(share_alike(later, ranges_m("depth.lag_ms=0", 20'000'000)), 0.95);
  EXPECT_LT(share_alike(later, ranges_m("depth.lag_ms=0", 0)), 0.5);
}

TEST(SettingsEffect, ViewSaysWhereFeaturesMayBe) {
  // Half the image's diagonal is 43 degrees off the axis, half its height 30.
  const auto extremes = [](const std::vector<std::string>& assignments) {
    double off_axis = 0.0, up = 90.0, down = 90.0;
    const auto features = features_with(assignments);
    EXPECT_GT(features->num_primary, 20u);
    for (const Eigen::Vector3f& bearing : features->bearings) {
      off_axis = std::max(off_axis, kRadToDeg * std::acos(double{bearing.z()}));
      up = std::min(up, kRadToDeg * std::acos(double{-bearing.y()}));
      down = std::min(down, kRadToDeg * std::acos(double{bearing.y()}));
    }
    return std::array{off_axis, up, down};
  };
  const auto [off_axis, up, down] = extremes({});
  ASSERT_GT(off_axis, 30.0);
  ASSERT_LT(up, 70.0);
  ASSERT_LT(down, 70.0);
  constexpr double kPixels = 0.6;  // Degrees that features are moved when they are located.
  EXPECT_LE(extremes({"view.max_angle_deg=20"})[0], 20.0 + kPixels);
  EXPECT_GE(extremes({"view.top_deg=80"})[1], 80.0 - kPixels);
  EXPECT_LT(extremes({"view.top_deg=80"})[2], 70.0);
  EXPECT_GE(extremes({"view.bottom_deg=80"})[2], 80.0 - kPixels);
  EXPECT_LT(extremes({"view.bottom_deg=80"})[1], 70.0);
}

TEST(SettingsEffect, MinInliersIsWhatAPoseMustRestOn) {
  const EffectRun usual = play({});
  int fewest = 1000;
  for (std::size_t i = 1; i < usual.results.size(); ++i) {
    ASSERT_EQ(usual.results[i].state, FrameState::kTracked) << i;
    fewest = std::min(fewest, usual.results[i].num_inliers);
  }
  ASSERT_LT(fewest, 480);
  const EffectRun strict = play({"tracking.min_inliers=490"});
  for (std::size_t i = 1; i < strict.results.size(); ++i) {
    if (strict.results[i].state != FrameState::kTracked) continue;
    EXPECT_GE(strict.results[i].num_inliers, 490);
  }
  EXPECT_EQ(strict.results[1].state, FrameState::kLost);
}

TEST(SettingsEffect, KeyframesComeWhenLittleIsShared) {
  const std::string no_parallax = "tracking.keyframe_parallax_px=1000";
  const auto few = play({no_parallax, "tracking.keyframe_ratio=0.1"}).keyframes();
  const auto many = play({no_parallax, "tracking.keyframe_ratio=1"}).keyframes();
  EXPECT_GT(many.size(), few.size() + 2);
}

TEST(SettingsEffect, KeyframesComeWithParallax) {
  const auto few = play({"tracking.keyframe_parallax_px=60"}).keyframes();
  const auto many = play({"tracking.keyframe_parallax_px=4"}).keyframes();
  EXPECT_GT(many.size(), few.size() + 2);
}

TEST(SettingsEffect, KeyframesComeAtLastWhileTheCameraMoves) {
  const auto longest_pause = [](const std::vector<int>& keyframes) {
    int longest = kNumFrames - 1 - keyframes.back();
    for (std::size_t k = 1; k < keyframes.size(); ++k) {
      longest = std::max(longest, keyframes[k] - keyframes[k - 1]);
    }
    return longest;
  };
  const std::vector<std::string> rare = {"tracking.keyframe_parallax_px=16",
                                         "tracking.keyframe_ratio=0.1"};
  std::vector<std::string> hurried = rare;
  hurried.push_back("tracking.max_keyframe_interval=5");
  EXPECT_GT(longest_pause(play(rare).keyframes()), 8);
  EXPECT_LE(longest_pause(play(hurried).keyframes()), 6);
}

/// The last frame at which a keyframe's pose in the map changed.
int last_move(const EffectRun& session, KeyframeId id) {
  int last = -1;
  for (std::size_t i = 1; i < session.maps.size(); ++i) {
    const auto& before = session.maps[i - 1]->keyframes();
    const auto& now = session.maps[i]->keyframes();
    if (!before.contains(id) || !now.contains(id)) continue;
    const bool moved = before.at(id).rig_from_world.matrix() != now.at(id).rig_from_world.matrix();
    if (moved) last = static_cast<int>(i);
  }
  return last;
}

TEST(SettingsEffect, WindowKeyframesAreThoseThatMove) {
  const std::string often = "tracking.keyframe_parallax_px=3";
  const EffectRun narrow = play({often, "mapping.window_keyframes=2"});
  const EffectRun wide = play({often, "mapping.window_keyframes=20"});
  ASSERT_GE(narrow.keyframes().size(), 5u);
  EXPECT_LT(last_move(narrow, KeyframeId{1}) + 4, last_move(wide, KeyframeId{1}));
}

/// A mask that leaves the columns from first to end.
Image mask_of_columns(int first, int end) {
  Image mask(320, 240);
  for (int v = 0; v < mask.height_px; ++v) std::fill(mask.row(v) + first, mask.row(v) + end, 255);
  return mask;
}

/// A map of what is on the right, and a session that sees the left at first: it begins a sub-map of
/// its own and finds out that both are the same place once it sees all.
struct Reunion {
  int num_submaps = 0;
  std::vector<int> unasked;  ///< Frames that saw a new map though no keyframe was due.
};

/// Stands still at the end, so that nothing else happens.
Reunion play_reunion(const std::vector<std::string>& assignments) {
  const Settings settings = settings_with(assignments);
  const Image right = mask_of_columns(150, 320), left = mask_of_columns(0, 140);
  System first(small_rig(), settings, Timing::kInline);
  for (const SimulatedFrame& frame : frames()) {
    FrameImages input = input_of(frame);
    input.mask = right.view();
    first.feed(input);
  }
  first.finish();
  System second(small_rig(), settings, Timing::kInline, first.map());
  std::shared_ptr<const Map> seen = second.map();
  std::vector<int> due;
  Reunion reunion;
  for (int i = 0; i < kNumFrames + 10; ++i) {
    FrameImages input = input_of(frames()[static_cast<std::size_t>(std::min(i, 18))]);
    input.timestamp_ns = 50'000'000 * std::int64_t{i};
    if (i < 12) input.mask = left.view();
    const TrackingResult result = second.feed(input);
    const bool is_due = std::find(due.begin(), due.end(), i) != due.end();
    if (second.map() != seen && !is_due) reunion.unasked.push_back(i);
    seen = second.map();
    // What begins a sub-map shows in the next frame.
    const bool is_first = due.empty();
    if (result.is_keyframe) due.push_back(i + (is_first ? 1 : settings.map_latency));
  }
  second.finish();
  reunion.num_submaps = second.statistics().num_submaps;
  return reunion;
}

TEST(SettingsEffect, LoopEnabledJoinsSubmaps) {
  EXPECT_EQ(play_reunion({"loop.enabled=true"}).num_submaps, 1);
  EXPECT_EQ(play_reunion({"loop.enabled=false"}).num_submaps, 2);
}

TEST(SettingsEffect, GlobalLatencySaysWhenAnAdjustmentIsTakenIn) {
  const std::vector<int> soon = play_reunion({"global_latency=12"}).unasked;
  const std::vector<int> late = play_reunion({"global_latency=15"}).unasked;
  ASSERT_FALSE(soon.empty());
  ASSERT_FALSE(late.empty());
  EXPECT_EQ(late.front(), soon.front() + 3);
}

/// Whether a map of a camera of 420 px that is said to have other ones ends with those that it was
/// told.
bool believes(double told_px, const std::string& assignment) {
  const auto told = make_described(1, make_test_pinhole(told_px));
  TestMap scene = look_around(make_described(1, make_test_pinhole(420.0)), told, 30);
  const Settings settings = settings_with({assignment, "loop.enabled=false"});
  GlobalMapper mapper(told, settings.mapping, settings.loop, settings.calibration, 1);
  mapper.take_over({scene.map.freeze(), std::make_shared<const PlaceIndex>()});
  mapper.finish();
  return !mapper.calibration().is_changed();
}

TEST(SettingsEffect, RefineSaysWhetherTheCalibrationChanges) {
  EXPECT_TRUE(believes(441.0, "calibration.refine=off"));
  EXPECT_FALSE(believes(441.0, "calibration.refine=auto"));
  EXPECT_TRUE(believes(421.5, "calibration.refine=auto"));
  EXPECT_FALSE(believes(421.5, "calibration.refine=on"));
}

/// Whoever adds a setting shows its effect here.
TEST(SettingsEffect, IsShownOfEverySetting) {
  Settings settings;
  std::vector<std::string> keys;
  for (const SettingField& field : list_settings(settings)) {
    if (std::holds_alternative<SettingField::Section>(field.value)) continue;
    if (!field.key.starts_with("experiment.")) keys.push_back(field.key);
  }
  EXPECT_THAT(keys,
              ::testing::UnorderedElementsAre("seed",
                                              "map_latency",
                                              "global_latency",
                                              "features.count",
                                              "features.min_contrast",
                                              "features.edges",  // Shown in image/extractor_test.
                                              "stereo.min_range_baselines",
                                              "depth.factor",
                                              "depth.lag_ms",
                                              "depth.inverse_offset",
                                              "view.max_angle_deg",
                                              "view.top_deg",
                                              "view.bottom_deg",
                                              "view.auto_mask",
                                              "tracking.min_inliers",
                                              "tracking.keyframe_ratio",
                                              "tracking.keyframe_parallax_px",
                                              "tracking.max_keyframe_interval",
                                              "mapping.window_keyframes",
                                              "calibration.refine",
                                              "loop.enabled",
                                              "markers.family",  // Shown in tests/markers_test.py.
                                              "markers.size",
                                              "markers.file"));
}

}  // namespace
}  // namespace waymark
