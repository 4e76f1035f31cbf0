// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/system.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "waymark/base/check.h"
#include "waymark/base/disk_memory.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/system/testing/sequence.h"

namespace waymark {
namespace {

struct Played {
  std::vector<TrackingResult> results;
  std::vector<TrajectoryFrame> trajectory;
  SystemStatistics statistics;
  std::shared_ptr<const Map> map;
};

Played play(Timing timing) {
  System system(small_rig(), small_settings(), timing);
  Played played;
  for (const SimulatedFrame& frame : frames())
    played.results.push_back(system.feed(input_of(frame)));
  system.finish();
  played.trajectory = system.trajectory();
  played.statistics = system.statistics();
  played.map = system.map();
  return played;
}

TEST(System, FollowsARenderedSequence) {
  const Played inline_run = play(Timing::kInline);
  ASSERT_EQ(inline_run.trajectory.size(), static_cast<std::size_t>(kNumFrames));
  EXPECT_GE(inline_run.statistics.num_keyframes, 3);
  EXPECT_EQ(inline_run.statistics.mapping_ms.size(),
            std::size_t{inline_run.map->keyframes().end_id().value});  // culled ones included
  EXPECT_EQ(inline_run.map->broken_invariants(), "");
  // Depth gives the scale and the first frame the origin.
  const Rigid3 world_from_first = frames()[0].world_from_rig;
  for (std::size_t i = 0; i < frames().size(); ++i) {
    const Rigid3 truth = world_from_first.inverse() * frames()[i].world_from_rig;
    const Rigid3 error = truth.inverse() * inline_run.trajectory[i].world_from_rig;
    EXPECT_LT(error.translation.norm(), 0.03) << "frame " << i;
    EXPECT_LT(error.log().tail<3>().norm(), 0.01) << "frame " << i;
  }
}

TEST(System, FramesThatWerePreparedGiveTheSameBits) {
  const Played alone = play(Timing::kInline);
  const auto forever = std::make_shared<int>(0);
  for (const unsigned num_threads : {1u, 2u, 4u}) {
    System system(small_rig(), small_settings(), Timing::kLockstep, nullptr, num_threads);
    EXPECT_EQ(system.max_prepared(), 2 * num_threads);
    std::size_t next = 0;
    for (std::size_t i = 0; i < frames().size(); ++i) {
      for (; next < std::min(i + system.max_prepared(), frames().size()); ++next) {
        system.prepare(input_of(frames()[next]), forever);
      }
      const TrackingResult result = system.feed(input_of(frames()[i]));
      EXPECT_EQ(result.num_features, alone.results[i].num_features) << "frame " << i;
      EXPECT_EQ(result.num_inliers, alone.results[i].num_inliers) << "frame " << i;
    }
    system.finish();
    const std::vector<TrajectoryFrame> trajectory = system.trajectory();
    ASSERT_EQ(trajectory.size(), alone.trajectory.size());
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      EXPECT_EQ(trajectory[i].world_from_rig.translation,
                alone.trajectory[i].world_from_rig.translation)
          << "frame " << i << ", " << num_threads << " threads";
    }
  }
  EXPECT_EQ(System(small_rig(), small_settings(), Timing::kInline).max_prepared(), 0u);
}

TEST(System, InlineAndLockstepGiveTheSameBits) {
  const Played alone = play(Timing::kInline);
  const Played threaded = play(Timing::kLockstep);
  ASSERT_GE(alone.statistics.num_keyframes, 3);
  for (std::size_t i = 0; i < alone.results.size(); ++i) {
    const TrackingResult& a = alone.results[i];
    const TrackingResult& b = threaded.results[i];
    ASSERT_EQ(a.state, b.state) << "frame " << i;
    ASSERT_EQ(a.is_keyframe, b.is_keyframe) << "frame " << i;
    ASSERT_EQ(a.num_inliers, b.num_inliers) << "frame " << i;
    ASSERT_EQ(a.world_from_rig.has_value(), b.world_from_rig.has_value());
    if (!a.world_from_rig) continue;
    ASSERT_EQ(a.world_from_rig->matrix(), b.world_from_rig->matrix()) << "frame " << i;
    ASSERT_EQ(a.covariance, b.covariance) << "frame " << i;
  }
  ASSERT_EQ(alone.trajectory.size(), threaded.trajectory.size());
  for (std::size_t i = 0; i < alone.trajectory.size(); ++i) {
    EXPECT_EQ(alone.trajectory[i].world_from_rig.matrix(),
              threaded.trajectory[i].world_from_rig.matrix());
  }
  EXPECT_EQ(alone.statistics.num_landmarks, threaded.statistics.num_landmarks);
}

TEST(System, MapsThatLieOnDiskGiveTheSameBits) {
  const Played alone = play(Timing::kInline);
  const testing::TemporaryFolder folder;
  const auto memory = std::make_shared<DiskMemory>(folder.path(), 0);
  System system(small_rig(), small_settings(), Timing::kLockstep);
  system.keep_map_in(memory);
  for (const SimulatedFrame& frame : frames()) {
    system.feed(input_of(frame));
    memory->let_go();
  }
  EXPECT_GT(memory->num_bytes(), std::size_t{30'000} * system.map()->keyframes().size());
  system.finish();
  const std::vector<TrajectoryFrame> trajectory = system.trajectory();
  ASSERT_EQ(trajectory.size(), alone.trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_EQ(trajectory[i].world_from_rig.matrix(), alone.trajectory[i].world_from_rig.matrix());
  }
}

TEST(System, FollowsInRealTime) {
  // Fed as fast as it goes: the map may come late, but nothing is lost.
  const Played played = play(Timing::kRealtime);
  ASSERT_EQ(played.trajectory.size(), static_cast<std::size_t>(kNumFrames));
  EXPECT_GE(played.statistics.num_keyframes, 2);
  EXPECT_EQ(played.map->broken_invariants(), "");
  for (std::size_t i = 0; i < frames().size(); ++i) {
    const Rigid3 truth = frames()[0].world_from_rig.inverse() * frames()[i].world_from_rig;
    const Rigid3 error = truth.inverse() * played.trajectory[i].world_from_rig;
    EXPECT_LT(error.translation.norm(), 0.05) << "frame " << i;
  }
}

TEST(System, BeginsAnewAfterAReset) {
  System system(small_rig(), small_settings(), Timing::kLockstep);
  for (int i = 0; i < 10; ++i) system.feed(input_of(frames()[i]));
  EXPECT_FALSE(system.map()->keyframes().is_empty());
  system.reset();
  EXPECT_TRUE(system.map()->keyframes().is_empty());
  EXPECT_TRUE(system.trajectory().empty());
  for (int i = 5; i < 15; ++i) {  // Time may go back, too.
    EXPECT_EQ(system.feed(input_of(frames()[i])).frame, FrameId{static_cast<std::uint32_t>(i - 5)});
  }
  system.finish();
  EXPECT_EQ(system.trajectory().size(), 10u);
}

TEST(System, MappingCanBeSwitchedOffAndOn) {
  System system(small_rig(), small_settings(), Timing::kLockstep);
  system.set_mapping(false);
  EXPECT_EQ(system.feed(input_of(frames()[0])).state, FrameState::kInitializing);
  system.set_mapping(true);
  for (int i = 1; i < 8; ++i) system.feed(input_of(frames()[i]));
  system.set_mapping(false);
  for (int i = 8; i < 16; ++i) {
    const TrackingResult result = system.feed(input_of(frames()[i]));
    EXPECT_EQ(result.state, FrameState::kTracked) << "frame " << i;
    EXPECT_FALSE(result.is_keyframe) << "frame " << i;
  }
  system.set_mapping(true);
  int num_keyframes = 0;
  for (int i = 16; i < kNumFrames; ++i) {
    num_keyframes += system.feed(input_of(frames()[i])).is_keyframe;
  }
  EXPECT_GT(num_keyframes, 0);
  system.finish();
  EXPECT_EQ(system.map()->broken_invariants(), "");
}

TEST(System, TellsWhatTheNewestFrameSaw) {
  System system(small_rig(), small_settings(), Timing::kInline);
  int num_recognized = 0;
  for (int i = 0; i < 5; ++i) {
    const TrackingResult& result = system.feed(input_of(frames()[i]));
    EXPECT_EQ(&result, &system.result());
    EXPECT_EQ(result.frame_in_map, FrameId{static_cast<std::uint32_t>(i)});
    ASSERT_NE(result.features, nullptr);
    if (result.landmarks.empty()) continue;
    EXPECT_EQ(result.landmarks.size(), result.features->size());
    const auto num_seen = std::count_if(result.landmarks.begin(),
                                        result.landmarks.end(),
                                        [](LandmarkId id) { return id.is_valid(); });
    EXPECT_GE(num_seen, result.num_inliers / 2);
    num_recognized += num_seen > 30;
  }
  EXPECT_GE(num_recognized, 4);
}

TEST(System, TimeStampsMustIncrease) {
  System system(small_rig(), small_settings(), Timing::kLockstep);
  system.feed(input_of(frames()[1]));
  EXPECT_THROW(system.feed(input_of(frames()[1])), InputError);
  EXPECT_THROW(system.feed(input_of(frames()[0])), InputError);
  EXPECT_NO_THROW(system.feed(input_of(frames()[2])));
  EXPECT_EQ(system.frame_states().size(), 2u);
}

TEST(System, ImagesMustHaveTheSizeOfTheCalibration) {
  System system(small_rig(), small_settings(), Timing::kInline);
  const Image small(160, 120);
  FrameImages input = input_of(frames()[0]);
  input.image0 = small.view();
  EXPECT_THROW(system.feed(input), InputError);
  input.image0 = {};
  EXPECT_THROW(system.feed(input), InputError);
  EXPECT_EQ(system.feed(input_of(frames()[0])).frame, FrameId{0});
}

TEST(System, AnImageWithoutFeaturesIsLostAndTheNextIsFoundAgain) {
  System system(small_rig(), small_settings(), Timing::kLockstep);
  for (int i = 0; i < 3; ++i) system.feed(input_of(frames()[static_cast<std::size_t>(i)]));
  const Image black(320, 240);
  FrameImages blind = input_of(frames()[3]);
  blind.image0 = black.view();
  const TrackingResult lost = system.feed(blind);
  EXPECT_EQ(lost.state, FrameState::kLost);
  EXPECT_EQ(lost.reason, FrameReason::kNoFeatures);
  EXPECT_FALSE(lost.world_from_rig);
  EXPECT_EQ(system.feed(input_of(frames()[4])).state, FrameState::kTracked);
  system.finish();
  EXPECT_EQ(system.trajectory().size(), 4u);
}

/// The first half of the frames, then a new session with the second half in the same map.
Played play_in_two_sessions(Timing timing) {
  constexpr std::size_t kHalf = kNumFrames / 2;
  System first(small_rig(), small_settings(), Timing::kInline);
  for (std::size_t i = 0; i < kHalf; ++i) first.feed(input_of(frames()[i]));
  first.finish();
  const auto map = first.map();
  const std::size_t num_before = map->keyframes().size();
  System second(small_rig(), small_settings(), timing, map);
  Played played;
  for (std::size_t i = kHalf; i < frames().size(); ++i) {
    played.results.push_back(second.feed(input_of(frames()[i])));
  }
  second.finish();
  played.trajectory = second.trajectory();
  played.statistics = second.statistics();
  played.map = second.map();
  EXPECT_EQ(map->keyframes().size(), num_before);
  EXPECT_EQ(map->broken_invariants(), "");
  return played;
}

TEST(System, GoesOnInAMapMadeBefore) {
  const Played played = play_in_two_sessions(Timing::kInline);
  EXPECT_EQ(played.statistics.num_submaps, 1);
  EXPECT_EQ(played.map->broken_invariants(), "");
  ASSERT_EQ(played.trajectory.size(), played.results.size());
  const Rigid3 world_from_first = frames()[0].world_from_rig;
  for (std::size_t i = 0; i < played.results.size(); ++i) {
    EXPECT_EQ(played.results[i].state, FrameState::kTracked) << "frame " << i;
    EXPECT_EQ(played.trajectory[i].frame, FrameId{static_cast<std::uint32_t>(i)});
    const auto& truth = frames()[kNumFrames / 2 + i].world_from_rig;
    const Rigid3 error =
        (world_from_first.inverse() * truth).inverse() * played.trajectory[i].world_from_rig;
    EXPECT_LT(error.translation.norm(), 0.03) << "frame " << i;
  }
  std::vector<FrameId> keyframes;
  played.map->keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { keyframes.push_back(keyframe.frame); });
  EXPECT_TRUE(std::is_sorted(keyframes.begin(), keyframes.end()));
  EXPECT_EQ(std::adjacent_find(keyframes.begin(), keyframes.end()), keyframes.end());
}

TEST(System, GoesOnWithTheSameBitsInAllTimings) {
  const Played alone = play_in_two_sessions(Timing::kInline);
  const Played threaded = play_in_two_sessions(Timing::kLockstep);
  ASSERT_EQ(alone.trajectory.size(), threaded.trajectory.size());
  for (std::size_t i = 0; i < alone.trajectory.size(); ++i) {
    EXPECT_EQ(alone.trajectory[i].world_from_rig.matrix(),
              threaded.trajectory[i].world_from_rig.matrix());
  }
}

TEST(System, TakesNoRangesIntoAMapWithoutScale) {
  Map map;
  map.add_submap(false);
  System system(small_rig(), small_settings(), Timing::kInline, map.freeze());
  EXPECT_THROW(system.feed(input_of(frames()[0])), InputError);
  FrameImages grey = input_of(frames()[0]);
  grey.depth = {};
  EXPECT_EQ(system.feed(grey).state, FrameState::kLost);
}

/// Totals after every frame, which are those of the map that is seen then.
std::vector<SystemStatistics> live_statistics(Timing timing) {
  System system(small_rig(), small_settings(), timing);
  std::vector<SystemStatistics> live;
  for (const SimulatedFrame& frame : frames()) {
    system.feed(input_of(frame));
    live.push_back(system.statistics());
    const std::shared_ptr<const Map> map = system.map();
    EXPECT_EQ(live.back().num_keyframes, static_cast<int>(map->keyframes().size()));
    EXPECT_EQ(live.back().num_landmarks, static_cast<int>(map->landmarks().size()));
    EXPECT_EQ(live.back().mapping_ms.size(), std::size_t{map->keyframes().end_id().value});
  }
  return live;
}

TEST(System, TellsTotalsWhileItRuns) {
  const std::vector<SystemStatistics> alone = live_statistics(Timing::kInline);
  const std::vector<SystemStatistics> threaded = live_statistics(Timing::kLockstep);
  EXPECT_GE(alone.back().num_keyframes, 2);
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(alone[i].num_landmarks, threaded[i].num_landmarks) << "frame " << i;
    EXPECT_EQ(alone[i].mapping_ms.size(), threaded[i].mapping_ms.size()) << "frame " << i;
  }
}

TEST(System, FinishesTwiceAndThenTakesNoFrames) {
  System system(small_rig(), small_settings(), Timing::kLockstep);
  system.feed(input_of(frames()[0]));
  system.finish();
  EXPECT_NO_THROW(system.finish());
  EXPECT_EQ(system.statistics().num_submaps, 1);
  EXPECT_THROW(system.feed(input_of(frames()[1])), CheckError);
}

TEST(System, FinishesWithoutAnyFrame) {
  System system(small_rig(), small_settings(), Timing::kLockstep);
  system.finish();
  EXPECT_TRUE(system.trajectory().empty());
  EXPECT_EQ(system.statistics().num_submaps, 0);
}

}  // namespace
}  // namespace waymark
