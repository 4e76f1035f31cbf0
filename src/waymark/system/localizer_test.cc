// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/localizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

constexpr int kNumLocalizedFrames = 25;

CameraDescription pinhole(double focal_px, int width_px, int height_px) {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1)};
  camera.width_px = width_px;
  camera.height_px = height_px;
  return camera;
}

SequenceSpec spec_of(const CameraDescription& camera) {
  SequenceSpec spec;
  spec.name = "small";
  spec.motion = "slide";
  spec.seed = 3;
  spec.num_frames = kNumLocalizedFrames;
  spec.chain = rgbd_chain(camera, 1000.0);
  return spec;
}

FrameImages depth_input_of(const SimulatedFrame& frame) {
  FrameImages input;
  input.timestamp_ns = frame.timestamp_ns;
  input.image0 = frame.images[0].view();
  input.depth = frame.depth.view();
  return input;
}

Settings localizer_settings() {
  Settings settings;
  settings.features.count = 500;
  settings.tracking.keyframe_parallax_px = 6.0;  // Several keyframes in a short sequence.
  return settings;
}

/// A map with depth, and views of another, sharper camera on the same way. Made once.
struct Scene {
  Scene() : query(spec_of(pinhole(260.0, 400, 260))) {
    SimulatedSequence sequence(spec_of(pinhole(210.0, 320, 240)));
    System system(sequence.rig(), localizer_settings(), Timing::kInline);
    for (int i = 0; i < kNumLocalizedFrames; ++i) system.feed(depth_input_of(sequence.frame(i)));
    system.finish();
    map = system.map();
    truth_of_map = sequence.world_from_rig(0);
    for (int i = 0; i < kNumLocalizedFrames; ++i) frames.push_back(query.frame(i));
  }

  Rigid3 truth(std::size_t i) const { return truth_of_map.inverse() * frames[i].world_from_rig; }

  SimulatedSequence query;
  std::shared_ptr<const Map> map;
  Rigid3 truth_of_map;  ///< World of the simulation from that of the map.
  std::vector<SimulatedFrame> frames;
};

Scene& scene() {
  static Scene made;
  return made;
}

void expect_pose(const TrackingResult& result, std::size_t i) {
  ASSERT_EQ(result.state, FrameState::kTracked) << "frame " << i;
  EXPECT_EQ(result.reason, FrameReason::kNone);
  EXPECT_EQ(result.submap, SubmapId{0});
  EXPECT_FALSE(result.is_keyframe);
  EXPECT_GE(result.num_inliers, 30);
  EXPECT_GE(result.num_matches, result.num_inliers);
  EXPECT_GT(result.covariance.trace(), 0.0);
  const Rigid3 error = scene().truth(i).inverse() * *result.world_from_rig;
  EXPECT_LT(error.translation.norm(), 0.03) << "frame " << i;
  EXPECT_LT(error.log().tail<3>().norm(), 0.01) << "frame " << i;
}

TEST(Localizer, FollowsAStreamOfAnotherCamera) {
  const std::size_t num_keyframes = scene().map->keyframes().size();
  Localizer localizer(scene().query.rig(), localizer_settings(), scene().map);
  for (std::size_t i = 0; i < scene().frames.size(); ++i) {
    expect_pose(localizer.track(depth_input_of(scene().frames[i])), i);
  }
  EXPECT_EQ(scene().map->keyframes().size(), num_keyframes);
  EXPECT_THROW(localizer.track(depth_input_of(scene().frames[0])), InputError);
}

/// A mask that leaves the columns from first to end.
Image columns(int first, int end) {
  Image mask(400, 260);
  for (int v = 0; v < 260; ++v) std::fill(mask.row(v) + first, mask.row(v) + end, 255);
  return mask;
}

/// How much of the left is covered: for a while nearly all that the map shows, and then all.
int num_covered(std::size_t frame) {
  if (frame < 4 || frame >= 14) return 0;
  return frame < 10 ? 150 : 220;
}

TEST(Localizer, BridgesWhatTheMapDoesNotShow) {
  const Image left = columns(0, 200);
  System system(scene().query.rig(), localizer_settings(), Timing::kInline);
  for (const SimulatedFrame& frame : scene().frames) {
    FrameImages input = depth_input_of(frame);
    input.mask = left.view();
    system.feed(input);
  }
  system.finish();
  const auto map = system.map();
  const Rigid3 map_from_world = scene().query.world_from_rig(0).inverse();
  for (const bool has_depth : {true, false}) {
    Localizer localizer(scene().query.rig(), localizer_settings(), map);
    for (std::size_t i = 0; i < scene().frames.size(); ++i) {
      FrameImages input = depth_input_of(scene().frames[i]);
      if (!has_depth) input.depth = {};
      const Image mask = columns(num_covered(i), 400);
      input.mask = mask.view();
      const bool is_found_alone = localizer.locate(input).world_from_rig.has_value();
      EXPECT_TRUE(num_covered(i) < 200 || !is_found_alone) << "frame " << i;
      const TrackingResult result = localizer.track(input);
      ASSERT_TRUE(result.world_from_rig) << "frame " << i << ", depth " << has_depth;
      const Rigid3 truth = map_from_world * scene().frames[i].world_from_rig;
      const Rigid3 error = truth.inverse() * *result.world_from_rig;
      // Without depth it drifts until the frame after the one that sees the map again.
      const bool drifts = !has_depth && i >= 10 && i < 15;
      EXPECT_LT(error.translation.norm(), drifts ? 0.2 : 0.03) << "frame " << i;
      EXPECT_LT(error.log().tail<3>().norm(), drifts ? 0.05 : 0.01) << "frame " << i;
    }
    EXPECT_EQ(&localizer.map(), map.get());
  }
}

TEST(Localizer, StraightensWhatARollingShutterSeesInAStream) {
  SequenceSpec spec = spec_of(pinhole(160.0, 240, 180));
  spec.motion = "inspect";
  SimulatedSequence sequence(spec);
  System system(sequence.rig(), localizer_settings(), Timing::kInline);
  for (int i = 0; i < spec.num_frames; ++i) system.feed(depth_input_of(sequence.frame(i)));
  system.finish();
  spec.readout_s = 0.03;
  SimulatedSequence walk(spec);
  Rig rolling = walk.rig();
  rolling.cameras[0].readout_s = spec.readout_s;
  Localizer as_global(walk.rig(), localizer_settings(), system.map());
  Localizer localizer(rolling, localizer_settings(), system.map());
  const auto error_m = [&](const TrackingResult& result, int i) {
    const Rigid3 truth = sequence.world_from_rig(0).inverse() * walk.world_from_rig(i);
    return result.world_from_rig ? (truth.inverse() * *result.world_from_rig).translation.norm()
                                 : 1.0;
  };
  double sum_global_m = 0.0, sum_m = 0.0;
  for (int i = 0; i < spec.num_frames; ++i) {
    const SimulatedFrame frame = walk.frame(i);
    const TrackingResult alone = localizer.locate(depth_input_of(frame));
    EXPECT_EQ(error_m(alone, i), error_m(as_global.locate(depth_input_of(frame)), i));
    sum_global_m += error_m(as_global.track(depth_input_of(frame)), i);
    sum_m += error_m(localizer.track(depth_input_of(frame)), i);
  }
  EXPECT_LT(sum_m, 0.6 * sum_global_m);
}

TEST(Localizer, FindsImagesInAnyOrderWithAndWithoutAHint) {
  Localizer localizer(scene().query.rig(), localizer_settings(), scene().map);
  for (const std::size_t i : {20u, 3u, 11u}) {
    FrameImages grey = depth_input_of(scene().frames[i]);
    grey.depth = {};
    const TrackingResult result = localizer.locate(grey);
    expect_pose(result, i);
    EXPECT_GE(result.num_candidates, 1);
    Rigid3 about = scene().truth(i);
    about.translation += Eigen::Vector3d(0.1, -0.05, 0.1);
    expect_pose(localizer.locate(grey, PosePrior{about, SubmapId{0}}), i);
    about.translation += Eigen::Vector3d(100.0, 0.0, 0.0);  // A hint that leads astray.
    expect_pose(localizer.locate(grey, PosePrior{about, SubmapId{0}}), i);
  }
}

TEST(Localizer, SaysWhatFailed) {
  Localizer localizer(scene().query.rig(), localizer_settings(), scene().map);
  const Image black(400, 260);
  FrameImages input = depth_input_of(scene().frames[5]);
  input.image0 = black.view();
  for (const TrackingResult& blind : {localizer.locate(input), localizer.track(input)}) {
    EXPECT_EQ(blind.state, FrameState::kLost);
    EXPECT_EQ(blind.reason, FrameReason::kNoFeatures);
    EXPECT_FALSE(blind.world_from_rig);
  }
  // Upside down nothing of the geometry fits; what looks alike is found.
  Image mirrored(400, 260);
  for (int v = 0; v < 260; ++v) {
    for (int u = 0; u < 400; ++u) {
      mirrored.row(v)[u] = scene().frames[5].images[0].row(v)[399 - u];
    }
  }
  input.timestamp_ns += 1;
  input.image0 = mirrored.view();
  input.depth = {};
  for (const TrackingResult& other : {localizer.locate(input), localizer.track(input)}) {
    EXPECT_EQ(other.state, FrameState::kLost);
    EXPECT_TRUE(other.reason == FrameReason::kTooFewMatches ||
                other.reason == FrameReason::kTooFewInliers ||
                other.reason == FrameReason::kNotVerified);
    EXPECT_GE(other.num_candidates, 1);
  }
}

TEST(Localizer, HasNothingToFindInAnEmptyMap) {
  Localizer localizer(scene().query.rig(), localizer_settings(), std::make_shared<const Map>());
  const TrackingResult result = localizer.locate(depth_input_of(scene().frames[0]));
  EXPECT_EQ(result.reason, FrameReason::kNoCandidate);
  EXPECT_EQ(localizer.track(depth_input_of(scene().frames[0])).reason, FrameReason::kNoCandidate);
}

TEST(Localizer, TheCameraMayChangeWhileAMapIsExtended) {
  System system(scene().query.rig(), localizer_settings(), Timing::kInline, scene().map);
  for (const SimulatedFrame& frame : scene().frames) system.feed(depth_input_of(frame));
  system.finish();
  EXPECT_EQ(system.map()->broken_invariants(), "");
  EXPECT_EQ(system.statistics().num_submaps, 1);
  const std::vector<TrajectoryFrame> trajectory = system.trajectory();
  ASSERT_EQ(trajectory.size(), scene().frames.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const Rigid3 error = scene().truth(i).inverse() * trajectory[i].world_from_rig;
    EXPECT_LT(error.translation.norm(), 0.02) << "frame " << i;
  }
}

/// The query's calibration after all frames were located one by one, told with another focal
/// length.
std::vector<CalibrationEstimate> refined_from(double factor, const char* refine) {
  CameraChain told = scene().query.spec().chain;
  for (int i = 0; i < 2; ++i)
    told.cameras[0].description.intrinsics[static_cast<std::size_t>(i)] *= factor;
  Settings settings = localizer_settings();
  settings.calibration.refine = refine;
  Localizer localizer(make_rig(told), settings, scene().map);
  for (const SimulatedFrame& frame : scene().frames) localizer.locate(depth_input_of(frame));
  const std::vector<CalibrationEstimate> estimates = localizer.calibration();
  const Rig rig = localizer.rig();
  const double change = estimates.empty() ? 0.0 : estimates[0].change;
  EXPECT_DOUBLE_EQ(rig.cameras[0].description->intrinsics[0], factor * 260.0 + change);
  EXPECT_EQ(rig.cameras[0].camera->width_px(), 400);
  return estimates;
}

TEST(Localizer, MendsTheCalibrationOfTheQuery) {
  const std::vector<CalibrationEstimate> estimates = refined_from(1.03, "auto");
  ASSERT_FALSE(estimates.empty());
  EXPECT_EQ(estimates[0].name, "cam0.fu");
  EXPECT_NEAR(estimates[0].given + estimates[0].change, 260.0, 1.3);
  EXPECT_LT(estimates[0].sigma, 1.0);
  EXPECT_TRUE(refined_from(1.03, "off").empty());
  EXPECT_TRUE(refined_from(1.0, "auto").empty());
}

}  // namespace
}  // namespace waymark
