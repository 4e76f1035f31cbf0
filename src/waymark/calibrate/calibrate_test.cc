// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/calibrate.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/base/testing/errors.h"
#include "waymark/image/image_header.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Grey images of a size.
class BlankInput : public Input {
 public:
  explicit BlankInput(const ImageSize& size) : size_(size) {}
  const InputInfo& info() const override { return info_; }
  std::optional<InputFrame> next() override {
    if (next_ == 20) return std::nullopt;
    InputFrame frame;
    frame.index = next_++;
    frame.images.emplace_back(size_.width_px, size_.height_px);
    return frame;
  }

 private:
  ImageSize size_;
  InputInfo info_;
  std::size_t next_ = 0;
};

/// A camera that is moved through the room, of which nobody says what it is.
class RenderedInput : public Input {
 public:
  RenderedInput(const CameraDescription& camera, const std::string& motion, int num_frames)
      : sequence_(spec_of(camera, motion, num_frames)) {}

  /// As fisheye lenses do: black is what lies farther from the centre.
  void light_circle(double radius_px) { circle_px_ = radius_px; }

  const InputInfo& info() const override { return info_; }
  std::optional<InputFrame> next() override {
    if (next_ == sequence_.num_frames()) return std::nullopt;
    SimulatedFrame rendered = sequence_.frame(next_);
    InputFrame frame;
    frame.index = static_cast<std::size_t>(next_++);
    frame.timestamp_ns = rendered.timestamp_ns;
    frame.images = std::move(rendered.images);
    if (circle_px_ > 0.0) blacken_around(frame.images.front());
    return frame;
  }

 private:
  static SequenceSpec spec_of(const CameraDescription& camera,
                              const std::string& motion,
                              int num_frames) {
    SequenceSpec spec;
    spec.motion = motion;
    spec.chain = mono_chain(camera);
    spec.num_frames = num_frames;
    return spec;
  }

  void blacken_around(Image& image) const {
    for (int y = 0; y < image.height_px; ++y) {
      for (int x = 0; x < image.width_px; ++x) {
        const double off_px = std::hypot(x - 0.5 * image.width_px, y - 0.5 * image.height_px);
        if (off_px <= circle_px_) continue;
        image.values[static_cast<std::size_t>(y * image.width_px + x)] = 0;
      }
    }
  }

  SimulatedSequence sequence_;
  InputInfo info_;
  double circle_px_ = 0.0;
  int next_ = 0;
};

CameraDescription wide_lens() {
  const double focal_px = focal_length_of(LensModel::kPerspective, 70.0 * kRadiansPerDegree, 400);
  CameraDescription lens = make_lens(LensModel::kPerspective, focal_px, 400, 300);
  lens.distortion_coeffs = {-0.12, 0.02, 0.0, 0.0};
  return lens;
}

TEST(Calibrate, FindsALensThatNobodyKnows) {
  RenderedInput input(wide_lens(), "inspect", 70);
  const EstimatedCalibration found = calibrate(input, {});
  EXPECT_EQ(found.model, LensModel::kPerspective);
  EXPECT_TRUE(found.is_sure) << describe(found);
  const std::vector<double>& numbers = found.camera.intrinsics;
  EXPECT_NEAR(numbers[0] / wide_lens().intrinsics[0], 1.0, 0.02) << describe(found);
  EXPECT_NEAR(numbers[2], 199.5, 4.0);
  EXPECT_NEAR(found.camera.distortion_coeffs[0], -0.12, 0.03);
  EXPECT_EQ(found.camera.width_px, 400);
  EXPECT_THAT(report(found), Contains(StartsWith("focal length: ")));
  EXPECT_EQ(make_rig(found.chain()).cameras.size(), 1u);
}

TEST(Calibrate, SaysWhereNothingTells) {
  RenderedInput input(wide_lens(), "still", 12);
  const EstimatedCalibration found = calibrate(input, {});
  EXPECT_FALSE(found.is_sure);
  EXPECT_THAT(describe(found), HasSubstr("the motion does not tell"));
  EXPECT_NEAR(found.fov_deg, 65.0, 10.0);
  RenderedInput again(wide_lens(), "still", 12);
  CalibrateOptions options;
  options.fov_deg = 80.0;
  EXPECT_NEAR(calibrate(again, options).fov_deg, 80.0, 0.5);
}

TEST(Calibrate, TakesAnImageInACircleForThatOfAFisheyeLens) {
  RenderedInput still(make_lens(LensModel::kFisheye, 55.0, 160, 160), "still", 12);
  still.light_circle(75.0);
  EXPECT_EQ(calibrate(still, {}).model, LensModel::kFisheye);
}

TEST(Calibrate, SeesAllDirections) {
  RenderedInput input(make_lens(LensModel::kEquirectangular, 0.0, 320, 160), "inspect", 3);
  const EstimatedCalibration found = calibrate(input, {});
  EXPECT_EQ(found.model, LensModel::kEquirectangular);
  EXPECT_TRUE(found.is_sure);
  EXPECT_EQ(found.camera.camera_model, "equirectangular");
}

TEST(Calibrate, WantsImagesThatCamerasTake) {
  for (const ImageSize& size : {ImageSize{15, 40}, {40, 8}, {1, 1}, {20001, 40}}) {
    BlankInput input(size);
    EXPECT_THAT(testing::input_error_of([&] { calibrate(input, {}); }),
                HasSubstr("expected width and height from 16 to 20000"));
  }
  BlankInput least({16, 16});
  EXPECT_FALSE(calibrate(least, {}).is_sure);
}

TEST(Calibrate, WantsImages) {
  RenderedInput input(wide_lens(), "still", 1);
  input.next();
  EXPECT_THAT(testing::input_error_of([&] { calibrate(input, {}); }),
              HasSubstr("there is no image, expected some"));
}

}  // namespace
}  // namespace waymark
