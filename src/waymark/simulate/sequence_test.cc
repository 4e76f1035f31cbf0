// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/sequence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "waymark/base/check.h"

namespace waymark {
namespace {

CameraDescription small_camera() {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {100.0, 100.0, 79.5, 59.5};
  camera.width_px = 160;
  camera.height_px = 120;
  return camera;
}

SequenceSpec small_spec() {
  SequenceSpec spec;
  spec.name = "small";
  spec.seed = 3;
  spec.num_frames = 20;
  spec.chain = mono_chain(small_camera());
  return spec;
}

TEST(Sequence, FramesDoNotDependOnOrderOrThreads) {
  SequenceSpec spec = small_spec();
  spec.effects.noise_sigma = 3.0;
  spec.effects.exposure_s = 0.02;
  spec.chain.depth_factor = 1000.0;
  spec.effects.inverse_depth_sigma = 0.002;
  SimulatedSequence one(spec, 1);
  SimulatedSequence three(spec, 3);
  const SimulatedFrame last = one.frame(7);
  const SimulatedFrame first = one.frame(2);
  EXPECT_EQ(first.images[0].values, three.frame(2).images[0].values);
  EXPECT_EQ(last.images[0].values, three.frame(7).images[0].values);
  EXPECT_EQ(last.depth.values, three.frame(7).depth.values);
  EXPECT_NE(first.images[0].values, last.images[0].values);
  EXPECT_EQ(last.timestamp_ns - first.timestamp_ns, 250'000'000);
}

/// Of three frames (FNV-1a).
std::uint64_t checksum(SimulatedSequence& sequence) {
  std::uint64_t sum = 14695981039346656037ull;
  for (const int index : {0, 7, 19}) {
    const SimulatedFrame frame = sequence.frame(index);
    for (const std::uint8_t value : frame.images[0].values) sum = (sum ^ value) * 1099511628211ull;
  }
  return sum;
}

/// Results are compared with those of earlier versions, on the same images.
TEST(Sequence, ImagesStayWhatTheyWere) {
  SequenceSpec spec = small_spec();
  spec.effects.noise_sigma = 2.0;
  spec.effects.exposure_s = 0.02;
  SimulatedSequence loop(spec);
  EXPECT_EQ(checksum(loop), 0x23462de840ce997aull);
  spec.motion = "turns_250";
  SimulatedSequence turns(spec);
  EXPECT_EQ(checksum(turns), 0x5efb6262d0ad1129ull);
}

TEST(Sequence, NoiseHasTheSigmaAskedFor) {
  SequenceSpec spec = small_spec();
  spec.motion = "still";
  SimulatedSequence clean(spec);
  spec.effects.noise_sigma = 4.0;
  SimulatedSequence noisy(spec);
  const Image a = clean.frame(0).images[0];
  const Image b = noisy.frame(0).images[0];
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const double error = static_cast<double>(b.values[i]) - a.values[i];
    sum += error;
    squares += error * error;
  }
  const double count = static_cast<double>(a.values.size());
  EXPECT_NEAR(sum / count, 0.0, 0.15);
  EXPECT_NEAR(std::sqrt(squares / count), 4.0, 0.15);
  EXPECT_NE(b.values, noisy.frame(1).images[0].values);
}

TEST(Sequence, SpansChangeTheExposure) {
  SequenceSpec spec = small_spec();
  spec.motion = "still";
  ImageEffects bright;
  bright.gain = 3.0;
  spec.spans.push_back({5, 7, bright});
  SimulatedSequence sequence(spec);
  const Image usual = sequence.frame(4).images[0];
  const Image changed = sequence.frame(5).images[0];
  for (std::size_t i = 0; i < usual.values.size(); ++i) {
    ASSERT_EQ(changed.values[i], std::min(255, 3 * usual.values[i]));
  }
  EXPECT_EQ(usual.values, sequence.frame(7).images[0].values);
}

double sharpness(const Image& image) {
  double sum = 0.0;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 1; x < image.width_px; ++x) sum += std::abs(image.row(y)[x] - image.row(y)[x - 1]);
  }
  return sum;
}

TEST(Sequence, MotionBlursAndStandingStillDoesNot) {
  SequenceSpec spec = small_spec();
  for (const bool is_moving : {false, true}) {
    spec.motion = is_moving ? "fast_turn" : "still";
    spec.effects.exposure_s = 0.0;
    SimulatedSequence sharp(spec);
    spec.effects.exposure_s = 0.03;
    SimulatedSequence blurred(spec);
    const double ratio =
        sharpness(blurred.frame(9).images[0]) / sharpness(sharp.frame(9).images[0]);
    if (is_moving) {
      EXPECT_LT(ratio, 0.8);
    } else {
      EXPECT_EQ(ratio, 1.0);
    }
  }
}

TEST(Sequence, RowsOfARollingShutterAreSeenOneAfterTheOther) {
  SequenceSpec spec = small_spec();
  spec.motion = "fast_turn";
  spec.rate_hz = 1000.0;
  spec.readout_s = 0.008;
  SimulatedSequence rolling(spec, 2);
  spec.readout_s = 0.0;
  SimulatedSequence global(spec);
  const Image image = rolling.frame(10).images[0];
  const int last_row = image.height_px - 1;
  for (const auto& [row, frame] : {std::pair(0, 6), std::pair(last_row, 14)}) {
    const Image expected = global.frame(frame).images[0];
    const Image other = global.frame(10).images[0];
    const auto is_row_of = [&, r = row](const Image& whole) {
      return std::equal(image.row(r), image.row(r) + image.width_px, whole.row(r));
    };
    EXPECT_TRUE(is_row_of(expected)) << row;
    EXPECT_FALSE(is_row_of(other)) << row;
  }
  spec.motion = "still";
  spec.readout_s = 0.008;
  EXPECT_EQ(SimulatedSequence(spec).frame(3).images[0].values,
            SimulatedSequence(spec).frame(9).images[0].values);
}

TEST(Sequence, DepthLags) {
  SequenceSpec spec = small_spec();
  spec.chain = rgbd_chain(small_camera(), 5000.0);
  SimulatedSequence prompt(spec);
  spec.depth_lag_s = 0.1;
  SimulatedSequence late(spec);
  const SimulatedFrame frame = late.frame(4);
  EXPECT_EQ(frame.images[0].values, prompt.frame(4).images[0].values);
  EXPECT_EQ(frame.depth.values, prompt.frame(6).depth.values);
  EXPECT_EQ(frame.depth_timestamp_ns, prompt.frame(6).timestamp_ns);
  EXPECT_NE(frame.depth.values, prompt.frame(4).depth.values);
}

TEST(Sequence, SecondCameraSeesFromItsPlace) {
  SequenceSpec spec = small_spec();
  const Rigid3 cam1_from_cam0(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())),
                              {-0.3, 0.02, 0.01});
  spec.chain = stereo_chain(small_camera(), small_camera(), cam1_from_cam0);
  SimulatedSequence sequence(spec);
  const SimulatedFrame frame = sequence.frame(3);
  ASSERT_EQ(frame.images.size(), 2u);
  ThreadPool pool(1);
  const Renderer renderer(make_world("room", 3), sequence.rig().cameras[1].camera);
  const Image expected = renderer.image(frame.world_from_rig * cam1_from_cam0.inverse(), pool);
  EXPECT_EQ(frame.images[1].values, expected.values);
}

TEST(Sequence, DepthNoiseIsInInverseDepth) {
  SequenceSpec spec = small_spec();
  spec.chain = rgbd_chain(small_camera(), 5000.0);
  SimulatedSequence clean(spec);
  spec.effects.inverse_depth_sigma = 0.004;
  SimulatedSequence noisy(spec);
  const DepthImage a = clean.frame(1).depth;
  const DepthImage b = noisy.frame(1).depth;
  double squares = 0.0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    ASSERT_GT(a.values[i], 0);
    squares += std::pow(5000.0 / b.values[i] - 5000.0 / a.values[i], 2);
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(a.values.size())), 0.004, 1e-4);
}

double brightness_of(const Image& image) {
  double sum = 0.0;
  for (const std::uint8_t value : image.values) sum += value;
  return sum / static_cast<double>(image.values.size());
}

TEST(Sequence, CamerasOfAPairAreExposedDifferently) {
  SequenceSpec spec = small_spec();
  spec.chain = stereo_chain(small_camera(), small_camera(), Rigid3());
  spec.effects.gain = 0.5;
  spec.gain1 = {1.4, 0.6};
  SimulatedSequence sequence(spec);
  const auto ratio = [&](int frame) {
    const std::vector<Image> images = sequence.frame(frame).images;
    return brightness_of(images[1]) / brightness_of(images[0]);
  };
  EXPECT_NEAR(ratio(0), 1.4, 0.02);
  EXPECT_NEAR(ratio(spec.num_frames - 1), 0.6, 0.02);
  EXPECT_NEAR(ratio(10), 1.4 - 0.8 * 10 / 19, 0.02);
}

TEST(Sequence, PairsAreAskedForWhereTheyAreNeeded) {
  SequenceSpec spec = small_spec();
  spec.gain1 = {1.0, 1.2};
  EXPECT_THROW(SimulatedSequence{spec}, InputError);
  spec = small_spec();
  spec.warped_px = {0.0, 0.5};
  EXPECT_THROW(SimulatedSequence{spec}, InputError);
}

}  // namespace
}  // namespace waymark
