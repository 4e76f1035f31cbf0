// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/session.h"

#include <gmock/gmock.h>

#include <thread>

#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/input/decode.h"
#include "waymark/session/merging.h"
#include "waymark/session/quality.h"
#include "waymark/session/testing/memory_input.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MemoryInput;
using ::testing::SizeIs;

constexpr std::size_t kNumFrames = 25;

SequenceSpec small_spec() {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {210.0, 210.0, 159.5, 119.5};
  camera.width_px = 320;
  camera.height_px = 240;
  SequenceSpec spec;
  spec.motion = "slide";
  spec.seed = 3;
  spec.num_frames = static_cast<int>(kNumFrames);
  spec.chain = rgbd_chain(camera, 1000.0);
  return spec;
}

/// Rendered once for all tests.
const std::vector<InputFrame>& rendered_frames() {
  static const std::vector<InputFrame> rendered = [] {
    SimulatedSequence sequence(small_spec(), std::thread::hardware_concurrency());
    std::vector<InputFrame> frames(kNumFrames);
    for (std::size_t i = 0; i < kNumFrames; ++i) {
      SimulatedFrame simulated = sequence.frame(static_cast<int>(i));
      frames[i].index = i;
      frames[i].timestamp_ns = simulated.timestamp_ns;
      frames[i].images = std::move(simulated.images);
      frames[i].depth = std::move(simulated.depth);
    }
    return frames;
  }();
  return rendered;
}

Rig small_rig() { return SimulatedSequence(small_spec()).rig(); }

Settings small_settings() {
  Settings settings;
  settings.features.count = 500;
  settings.tracking.keyframe_parallax_px = 6.0;  // Several keyframes in a short sequence.
  return settings;
}

TEST(RunSession, GoesFromInputToResults) {
  std::vector<InputFrame> frames = rendered_frames();
  frames[10] = {};
  frames[10].index = 10;
  frames[10].timestamp_ns = rendered_frames()[10].timestamp_ns;
  frames[10].fault = FrameFault::kUnreadable;
  MemoryInput input(std::move(frames));
  System system(small_rig(), small_settings(), Timing::kInline);
  std::size_t num_observed = 0;
  std::size_t num_fed = 0;
  int num_ends = 0;
  SessionHooks hooks;
  hooks.observer = [&](const auto& row, const auto&) { EXPECT_EQ(row.index, num_observed++); };
  hooks.on_result = [&](const auto&, const auto&) { ++num_fed; };
  hooks.on_input_end = [&] {
    ++num_ends;
    EXPECT_EQ(num_observed, kNumFrames);
  };
  const SessionResults results = run_session(input, system, hooks);

  EXPECT_EQ(num_observed, kNumFrames);
  EXPECT_EQ(num_fed, kNumFrames - 1);
  EXPECT_EQ(num_ends, 1);
  EXPECT_EQ(results.summary.counts.tracked, kNumFrames - 1);
  EXPECT_EQ(results.summary.counts.unreadable, 1u);
  ASSERT_THAT(results.trajectories, SizeIs(1));
  EXPECT_THAT(results.trajectories[0], SizeIs(kNumFrames - 1));
  EXPECT_EQ(results.summary.num_trajectory_lines, kNumFrames - 1);
  EXPECT_GE(results.keyframes.size(), 3u);
  EXPECT_EQ(results.keyframes.size(), system.map()->keyframes().size());
  EXPECT_FALSE(results.table.frames[10].submap.is_valid());
  EXPECT_FALSE(results.table.frames[10].num_features);
  EXPECT_FALSE(results.table.frames[10].picture.is_known);
  EXPECT_GT(results.table.frames[11].num_features, 100);
  EXPECT_GT(results.table.frames[11].picture.contrast, 10);
  EXPECT_EQ(results.points.size(), system.map()->landmarks().size());
  EXPECT_THAT(results.summary.loop_frames, IsEmpty());
  EXPECT_GT(results.summary.wall_s, 0.0);

  const testing::TemporaryFolder folder;
  write_results(folder.path(), results);
  EXPECT_THAT(read_trajectory(folder / "trajectory.txt"), SizeIs(kNumFrames - 1));
  EXPECT_THAT(read_trajectory(folder / "keyframes.txt"), SizeIs(results.keyframes.size()));
  EXPECT_FALSE(std::filesystem::exists(folder / "trajectory_1.txt"));
  EXPECT_THAT(read_text_file(folder / "frames.csv", "a table"), HasSubstr("\n10,"));
  EXPECT_THAT(read_text_file(folder / "summary.json", "a summary"), HasSubstr("\"unreadable\": 1"));
}

/// Walks to and fro in a room behind a patterned bonnet at the bottom of the image.
std::vector<InputFrame> frames_behind_bonnet(std::size_t count) {
  constexpr std::size_t kWay = 20;
  SequenceSpec spec = small_spec();
  spec.motion = "loop";
  spec.num_frames = 200;
  SimulatedSequence sequence(spec, std::thread::hardware_concurrency());
  std::vector<SimulatedFrame> way;
  for (int i = 0; i <= static_cast<int>(kWay); ++i) {
    Image& image = way.emplace_back(sequence.frame(i)).images[0];
    for (int y = 200; y < 240; ++y) {
      for (int x = 90; x < 230; ++x) {
        image.row(y)[x] = static_cast<std::uint8_t>((x / 4 * 37 ^ y / 4 * 91) % 251);
      }
    }
  }
  std::vector<InputFrame> frames(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t turn = i % (2 * kWay);
    const SimulatedFrame& simulated = way[std::min(turn, 2 * kWay - turn)];
    frames[i].index = i;
    frames[i].timestamp_ns = 50'000'000 * static_cast<std::int64_t>(i);
    frames[i].images = simulated.images;
    frames[i].depth = simulated.depth;
  }
  return frames;
}

TEST(RunSession, KeepsFeaturesOffWhatMovesAlong) {
  const std::vector<InputFrame> frames = frames_behind_bonnet(100);
  const testing::TemporaryFolder folder;
  std::vector<std::vector<StampedPose>> trajectories;
  for (const Timing timing : {Timing::kInline, Timing::kLockstep}) {
    MemoryInput input(frames);
    System system(small_rig(), small_settings(), timing);
    const SessionResults results = run_session(input, system);
    EXPECT_NEAR(results.summary.moves_along.value_or(0.0), 140.0 * 40.0 / (320.0 * 240.0), 0.02);
    for (const Keypoint& keypoint : system.result().features->keypoints) {
      EXPECT_FALSE(keypoint.y_px > 205.0f && std::abs(keypoint.x_px - 160.0f) < 60.0f);
    }
    write_results(folder.path(), results);
    const std::optional<Image> mask = read_grey_image(folder / "view_mask.png");
    ASSERT_TRUE(mask);
    EXPECT_EQ(mask->values, system.ego_mask().values);
    trajectories.push_back(results.trajectories.at(0));
  }
  ASSERT_EQ(trajectories[0].size(), trajectories[1].size());
  EXPECT_EQ(trajectories[0].back().world_from_camera.matrix(),
            trajectories[1].back().world_from_camera.matrix());

  MemoryInput input({frames.begin(), frames.begin() + 3});
  System system(small_rig(), small_settings(), Timing::kInline);
  const SessionResults results = run_session(input, system);
  EXPECT_EQ(results.summary.moves_along, 0.0);
  write_results(folder.path(), results);
  EXPECT_FALSE(std::filesystem::exists(folder / "view_mask.png")) << "of an earlier run";
}

TEST(RunSession, EndsEarlyWithWhatItHas) {
  MemoryInput input(rendered_frames());
  System system(small_rig(), small_settings(), Timing::kInline);
  std::size_t num_observed = 0;
  SessionHooks hooks;
  hooks.should_stop = [&] { return num_observed == 8; };
  hooks.observer = [&](const auto&, const auto&) { ++num_observed; };
  const SessionResults results = run_session(input, system, hooks);
  EXPECT_THAT(results.table.frames, SizeIs(8));
  EXPECT_EQ(results.summary.counts.tracked, 8u);
}

void expect_failure(const SessionResults& results, const std::string& message) {
  ASSERT_TRUE(results.failure);
  EXPECT_THAT(
      [&] { std::rethrow_exception(results.failure); },
      ::testing::Throws<InputError>(::testing::Property(&InputError::what, HasSubstr(message))));
}

TEST(RunSession, HasItsResultsWhenTheInputThrows) {
  for (const Timing timing : {Timing::kInline, Timing::kLockstep, Timing::kRealtime}) {
    MemoryInput input(rendered_frames(), 20);
    System system(small_rig(), small_settings(), timing);
    const SessionResults results = run_session(input, system);
    expect_failure(results, "torn out");
    EXPECT_FALSE(system.map()->keyframes().is_empty());
    EXPECT_EQ(system.map()->broken_invariants(), "");
    EXPECT_THAT(results.table.frames, SizeIs(20));
    EXPECT_EQ(results.summary.counts.tracked, 20u);
    ASSERT_THAT(results.trajectories, SizeIs(1));
    EXPECT_THAT(results.trajectories[0], SizeIs(20));
  }
}

TEST(RunSession, HasItsResultsWhenAFrameCannotBeFed) {
  std::vector<InputFrame> frames = rendered_frames();
  frames[20].timestamp_ns = frames[19].timestamp_ns;
  MemoryInput input(std::move(frames));
  System system(small_rig(), small_settings(), Timing::kLockstep);
  const SessionResults results = run_session(input, system);
  expect_failure(results, "time stamp is not later");
  ASSERT_THAT(results.trajectories, SizeIs(1));
  EXPECT_GE(results.trajectories[0].size(), 19u);
}

TEST(RunSession, HasItsResultsWhenAnObserverThrows) {
  MemoryInput input(rendered_frames());
  System system(small_rig(), small_settings(), Timing::kLockstep);
  SessionHooks hooks;
  hooks.on_result = [](const FrameImages&, const TrackingResult& result) {
    if (result.frame.value == 20) throw InputError("observer", "gave up");
  };
  const SessionResults results = run_session(input, system, hooks);
  expect_failure(results, "gave up");
  ASSERT_THAT(results.trajectories, SizeIs(1));
  EXPECT_THAT(results.trajectories[0], SizeIs(20));
}

TEST(RunSession, HasNoResultsWhenNothingWasFed) {
  MemoryInput input(rendered_frames(), 0);
  System system(small_rig(), small_settings(), Timing::kInline);
  EXPECT_THROW(run_session(input, system), InputError);
}

TEST(WriteResults, WritesWhateverCanBeWritten) {
  MemoryInput input(rendered_frames());
  System system(small_rig(), small_settings(), Timing::kInline);
  const SessionResults results = run_session(input, system);
  const testing::TemporaryFolder folder;
  for (const char* name : {"trajectory.txt", "frames.csv"}) {
    std::filesystem::create_directory(folder / name);
  }
  EXPECT_THROW(prepare_results(folder.path()), OutputError);
  EXPECT_THAT(
      [&] { write_results(folder.path(), results); },
      ::testing::Throws<OutputError>(::testing::Property(
          &OutputError::what, AllOf(HasSubstr("trajectory.txt"), HasSubstr("frames.csv")))));
  EXPECT_THAT(read_trajectory(folder / "keyframes.txt"), SizeIs(results.keyframes.size()));
  EXPECT_THAT(read_text_file(folder / "summary.json", "a summary"), HasSubstr("keyframes"));
}

TEST(RunSession, HasRowsButNoTrajectoryWhereNothingIsSeen) {
  std::vector<InputFrame> frames = rendered_frames();
  for (InputFrame& frame : frames) {
    frame.images = {Image(320, 240)};
    frame.depth = DepthImage(320, 240);
  }
  MemoryInput input(std::move(frames));
  System system(small_rig(), small_settings(), Timing::kInline);
  const SessionResults results = run_session(input, system);
  EXPECT_THAT(results.table.frames, SizeIs(kNumFrames));
  EXPECT_EQ(results.summary.counts.tracked, 0u);
  EXPECT_THAT(results.trajectories, SizeIs(0));
  const testing::TemporaryFolder folder;
  write_results(folder.path(), results);
  EXPECT_EQ(read_text_file(folder / "trajectory.txt", "a trajectory"), "");
}

TEST(Assess, SaysHowWellAMapAgreesWithItself) {
  MemoryInput input(rendered_frames());
  System system(small_rig(), small_settings(), Timing::kInline);
  const SessionResults results = run_session(input, system);
  ASSERT_TRUE(results.summary.quality);
  const RunQuality& quality = *results.summary.quality;
  EXPECT_GT(quality.reprojection_px, 0.1);
  EXPECT_LT(quality.reprojection_px, 1.2);
  EXPECT_GT(quality.matches_kept, 0.7);
  EXPECT_LE(quality.matches_kept, 1.0);
  EXPECT_TRUE(quality.is_metric);
  const SimulatedSequence truth(small_spec());
  double length_m = 0.0;
  for (int i = 1; i < truth.num_frames(); ++i) {
    length_m +=
        (truth.world_from_rig(i).translation - truth.world_from_rig(i - 1).translation).norm();
  }
  EXPECT_NEAR(quality.length, length_m, 0.05 * length_m);
  EXPECT_THAT(describe(quality, 1),
              ::testing::MatchesRegex(
                  "reprojection error 0\\... px, .. % of the matches kept, 1 loop, .\\.. m long"));

  Map bent = Map::thaw(*system.map());
  std::vector<LandmarkId> ids;
  bent.landmarks().for_each([&](LandmarkId id, const Landmark&) { ids.push_back(id); });
  for (const LandmarkId id : ids) {
    bent.move_landmark(id, 1.025 * bent.landmarks().at(id).position_in_world);
  }
  const RunQuality worse = assess(bent, results.table.frames, results.trajectories);
  EXPECT_GT(worse.reprojection_px, 1.5 * quality.reprojection_px);
  EXPECT_EQ(assess(Map(), {}, {}).reprojection_px, 0.0);
}

/// A map of the rendered frames, made once.
std::shared_ptr<const Map> small_map() {
  static const std::shared_ptr<const Map> map = [] {
    MemoryInput input(rendered_frames());
    System system(small_rig(), small_settings(), Timing::kInline);
    run_session(input, system);
    return system.map();
  }();
  return map;
}

TEST(LocalizeInput, FindsStreamsAndSingleImagesInAMap) {
  for (const ImageOrder order : {ImageOrder::kStream, ImageOrder::kUnordered}) {
    MemoryInput input(rendered_frames());
    Localizer localizer(small_rig(), small_settings(), small_map());
    std::size_t num_observed = 0;
    const SessionResults results = localize_input(
        input, localizer, order, nullptr, [&](const auto&, const auto&) { ++num_observed; });
    EXPECT_EQ(num_observed, kNumFrames);
    EXPECT_GE(*results.summary.localized, kNumFrames - 3);
    ASSERT_THAT(results.trajectories, SizeIs(1));
    EXPECT_THAT(results.trajectories[0], SizeIs(*results.summary.localized));
    EXPECT_EQ(results.summary.keyframes, small_map()->keyframes().size());
    EXPECT_EQ(results.summary.submaps, 1u);
    for (const StampedPose& pose : results.trajectories[0]) {
      EXPECT_LT(pose.world_from_camera.translation.norm(), 10.0);
    }
  }
}

TEST(LocalizeInput, HasItsResultsWhenTheInputThrows) {
  MemoryInput input(rendered_frames(), 6);
  Localizer localizer(small_rig(), small_settings(), small_map());
  const SessionResults results =
      localize_input(input, localizer, ImageOrder::kStream, nullptr, nullptr);
  expect_failure(results, "torn out");
  EXPECT_THAT(results.table.frames, SizeIs(6));
  EXPECT_GE(*results.summary.localized, 3u);
}

TEST(MergeStored, JoinsAMapWithItselfAndKeepsTheImagesOfBoth) {
  StoredMap a;
  a.map = small_map();
  StoredMap b = a;
  a.settings = "seed: 1\n";
  a.images[KeyframeId{0}] = std::make_shared<const std::string>("of a");
  b.images[KeyframeId{0}] = std::make_shared<const std::string>("of b");
  const MergedStored merged = merge_stored(a, b, 0);
  EXPECT_EQ(merged.num_parts_before, 2u);
  EXPECT_EQ(merged.num_parts, 1u);
  EXPECT_GE(merged.num_joins, 1);
  EXPECT_FALSE(merged.is_incomparable);
  EXPECT_EQ(merged.stored.map->broken_invariants(), "");
  EXPECT_EQ(merged.stored.settings, "seed: 1\n");
  ASSERT_THAT(merged.stored.images, SizeIs(2));
  EXPECT_EQ(*merged.stored.images.at(KeyframeId{0}), "of a");
  EXPECT_EQ(*merged.stored.images.at(small_map()->keyframes().end_id()), "of b");
}

TEST(MergeStored, SaysWhenUnitsKeepMapsApart) {
  StoredMap a;
  a.map = small_map();
  StoredMap b;
  Map free;
  Keyframe keyframe = *small_map()->keyframes().find(small_map()->submaps()[0].root);
  keyframe.submap = free.add_submap(false);
  keyframe.parent = {};
  free.add_keyframe(std::move(keyframe));
  b.map = free.freeze();
  const MergedStored merged = merge_stored(a, b, 0);
  EXPECT_TRUE(merged.is_incomparable);
  EXPECT_EQ(merged.num_joins, 0);
  EXPECT_EQ(merged.num_parts, 2u);
}

}  // namespace
}  // namespace waymark
