// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/session_options.h"

#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/testing/images.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::input_error_of;

constexpr const char* kCameras = R"(
cam0:
  camera_model: pinhole
  intrinsics: [50, 50, 31.5, 23.5]
  distortion_model: none
  distortion_coeffs: []
  resolution: [64, 48]
seed: 5
)";

class OpenSession : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"0.png", "1.png"}) {
      testing::write_image(folder_ / "images" / name, 64, 48, 90.0);
    }
    options_.input = folder_ / "images";
    options_.configs = {folder_.write("cameras.yaml", kCameras)};
    options_.timing = Timing::kInline;
  }

  testing::TemporaryFolder folder_;
  SessionOptions options_;
};

TEST_F(OpenSession, BringsInputCamerasAndSettingsTogether) {
  options_.assignments = {"features.count=321"};
  Session session = open_session(options_);
  EXPECT_EQ(session.settings.seed, 5);
  EXPECT_EQ(session.settings.features.count, 321);
  EXPECT_EQ(session.input->info().num_frames, 2u);
  EXPECT_TRUE(session.system->map()->keyframes().is_empty());
  EXPECT_THAT(session.description, Contains(HasSubstr("camera 0: pinhole")));
  options_.seed = 9;
  EXPECT_EQ(open_session(options_).settings.seed, 9);
}

TEST_F(OpenSession, SaysWhatIsWrong) {
  options_.map_in = folder_ / "none.wmap";
  EXPECT_THAT(input_error_of([&] { open_session(options_); }), HasSubstr("none.wmap"));
  options_.map_in.clear();
  options_.assignments = {"features.cuont=321"};
  EXPECT_THAT(input_error_of([&] { open_session(options_); }), HasSubstr("cuont"));
  options_.assignments.clear();
  options_.configs.clear();
  EXPECT_THAT(input_error_of([&] { open_session(options_); }),
              HasSubstr("carries no calibration, expected its cameras in a file given with -c"));
}

TEST_F(OpenSession, KnowsAPlaceholderForACalibration) {
  for (const char* numbers : {"[1, 1, 0, 0]", "[1, 1, 31.5, 23.5]", "[50, 50, 0, 0]"}) {
    std::string cameras = kCameras;
    const std::string measured = "[50, 50, 31.5, 23.5]";
    cameras.replace(cameras.find(measured), measured.size(), numbers);
    options_.configs = {folder_.write("cameras.yaml", cameras)};
    for (const auto resize_px : {std::optional<int>(), std::optional<int>(32)}) {
      options_.reading.resize_px = resize_px;
      EXPECT_THAT(input_error_of([&] { open_session(options_); }), HasSubstr("a placeholder, exp"))
          << numbers;
    }
  }
}

TEST_F(OpenSession, GoesOnInAMap) {
  StoredMap stored;
  stored.map = Map().freeze();
  options_.map_in = folder_ / "empty.wmap";
  save_map(options_.map_in, stored);
  const Session session = open_session(options_);
  EXPECT_THAT(session.description, Contains(HasSubstr("empty.wmap: 0 keyframes")));
}

}  // namespace
}  // namespace waymark
