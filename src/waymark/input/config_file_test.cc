// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/config_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "waymark/base/rng.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;

constexpr const char* kOwn =
    "cam0:\n  camera_model: pinhole\n  intrinsics: [400, 401, 320, 240]\n"
    "  distortion_model: none\n  resolution: [640, 480]\n";
constexpr const char* kOpencv =
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
    "camera_matrix: [400, 0, 320, 0, 401, 240, 0, 0, 1]\ndistortion_coefficients: [0, 0, 0, 0]\n";
constexpr const char* kRosFile =
    "width: 640\nheight: 480\ndistortion_model: plumb_bob\nd: [0, 0, 0, 0, 0]\n"
    "k: [400, 0, 320, 0, 401, 240, 0, 0, 1]\n";
constexpr const char* kColmapFile = "# Camera list\n7 PINHOLE 640 480 400 401 320.5 240.5\n";
constexpr const char* kNerfstudio =
    R"({"camera_model": "OPENCV", "fl_x": 400, "fl_y": 401, "cx": 320.5, "cy": 240.5, "w": 640,
        "h": 480, "frames": [{"file_path": "a.jpg", "transform_matrix": [[1]]}]})";
constexpr const char* kPerFrame =
    R"({"frames": [{"file_path": "a.jpg", "fl_x": 400, "fl_y": 401, "cx": 320.5, "cy": 240.5,
        "w": 640, "h": 480}]})";

std::string colmap_binary() {
  std::string bytes;
  const auto add = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  add(std::uint64_t{1});
  add(std::uint32_t{7});
  add(std::int32_t{1});  // PINHOLE
  add(std::uint64_t{640});
  add(std::uint64_t{480});
  for (const double value : {400.0, 401.0, 320.5, 240.5}) add(value);
  return bytes;
}

CameraChain chain_in(const std::filesystem::path& path) {
  std::vector<std::string> notes;
  const auto chain = read_camchain(parse_config(read_config_file(path, notes)));
  EXPECT_TRUE(chain);
  return chain.value_or(CameraChain());
}

TEST(ConfigFile, IsTakenAsOtherProgramsWriteIt) {
  const testing::TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> files = {{"own.yaml", kOwn},
                                                                  {"opencv.yaml", kOpencv},
                                                                  {"ros.yaml", kRosFile},
                                                                  {"cameras.txt", kColmapFile},
                                                                  {"cameras.bin", colmap_binary()},
                                                                  {"transforms.json", kNerfstudio},
                                                                  {"per_frame.json", kPerFrame}};
  for (const auto& [name, text] : files) {
    SCOPED_TRACE(name);
    folder.write(name, text);
    const CameraChain chain = chain_in(folder / name);
    ASSERT_EQ(chain.cameras.size(), 1u);
    EXPECT_THAT(chain.cameras[0].description.intrinsics, ElementsAre(400, 401, 320, 240));
    EXPECT_EQ(chain.cameras[0].description.width_px, 640);
    EXPECT_EQ(chain.cameras[0].description.height_px, 480);
  }
}

TEST(ConfigFile, OfSettingsAloneStaysAsItIs) {
  const testing::TemporaryFolder folder;
  folder.write("s.yaml", "features: {count: 700}\n");
  std::vector<std::string> notes;
  EXPECT_EQ(read_config_file(folder / "s.yaml", notes).text, "features: {count: 700}\n");
  EXPECT_TRUE(notes.empty());
}

/// The tool that reads them has tests of its own, in Python.
TEST(ConfigFile, OfASlamProgramIsLeftToWhoReadsIt) {
  for (const char* text : {"Camera:\n  model: perspective\n",
                           "Camera.model: perspective\n",
                           "%YAML:1.0\nCamera1.fx: 400\n",
                           "Camera.fx: 400\n"}) {
    const ConfigSource source{"slam.yaml", text};
    EXPECT_THAT(input_error_of([&] { read_foreign_cameras(source); }),
                HasSubstr("slam.yaml: has settings of OpenVSLAM or ORB-SLAM, expected a camchain: "
                          "waymark import --settings slam.yaml -o camchain.yaml"));
    const SlamSettingsReader reader = [](const ConfigSource& read) {
      CameraChain chain;
      chain.notes.push_back(read.name);
      return chain;
    };
    EXPECT_THAT(read_foreign_cameras(source, reader).value().notes, ElementsAre("slam.yaml"));
  }
}

TEST(ConfigFile, OfTwoCamerasIsAPairOrTheLastOne) {
  const testing::TemporaryFolder folder;
  const std::string turn = "r: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";
  const std::string plane = "401, 240, 0, 0, 0, 1, 0]\n";
  const std::vector<std::filesystem::path> pair = {
      folder.write("left.yaml", kRosFile + turn + "p: [400, 0, 320, 0, 0, " + plane),
      folder.write("right.yaml", kRosFile + turn + "p: [400, 0, 320, -40, 0, " + plane)};
  std::vector<std::string> notes;
  const auto chain = read_camchain(merge_configs(read_config_files(pair, notes)));
  ASSERT_EQ(chain.value().cameras.size(), 2u);
  EXPECT_NEAR(chain->cameras[1].cam_from_rig.translation.x(), -0.1, 1e-12);
  const std::vector<std::filesystem::path> others = {folder.write("opencv.yaml", kOpencv),
                                                     folder.write("ros.yaml", kRosFile)};
  notes.clear();
  EXPECT_EQ(read_camchain(merge_configs(read_config_files(others, notes))).value().cameras.size(),
            1u);
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("ros.yaml: takes the place of what ")));
}

TEST(ConfigFile, OfNerfstudioMayHaveOtherModels) {
  const auto read = [](const std::string& text) {
    return read_foreign_cameras({"t.json", text}).value();
  };
  const std::string rest = R"("w": 640, "h": 480, "frames": []})";
  const CameraChain fisheye =
      read(R"({"camera_model": "OPENCV_FISHEYE", "fl_x": 300, "k1": 0.1, )" + rest);
  EXPECT_EQ(fisheye.cameras[0].description.distortion_model, "equidistant");
  EXPECT_THAT(fisheye.cameras[0].description.intrinsics, ElementsAre(300, 300, 319.5, 239.5));
  const CameraChain angle = read(R"({"camera_angle_x": 1.5707963267948966, )" + rest);
  EXPECT_NEAR(angle.cameras[0].description.intrinsics[0], 320.0, 1e-9);
  const CameraChain distorted = read(R"({"fl_x": 300, "k1": 0.1, "k3": 0.2, "p2": 0.3, )" + rest);
  EXPECT_THAT(distorted.cameras[0].description.distortion_coeffs, ElementsAre(0.1, 0, 0, 0.3, 0.2));
  EXPECT_EQ(read(R"({"camera_model": "EQUIRECTANGULAR", "w": 640, "h": 320, "frames": []})")
                .cameras[0]
                .description.camera_model,
            "equirectangular");
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {R"({"fl_x": 300, "k4": 0.1, )" + rest, "fourth radial term"},
           {R"({"camera_model": "FISHEYE624", "fl_x": 1, )" + rest, "FISHEYE624"},
           {R"({"fl_x": "wide", )" + rest, "fl_x that is no number"},
           {R"({"frames": []})", "has no w, which is needed"},
           {R"({"fl_x": 3, "frames": [)", "is no JSON"}}) {
    EXPECT_THAT(input_error_of([&, &settings = text] { read(settings); }), HasSubstr(words))
        << text;
  }
}

TEST(ConfigFile, ThatIsDamagedIsOneLine) {
  Rng rng(7, 1);
  for (const std::string& whole :
       {std::string(kColmapFile), colmap_binary(), std::string(kNerfstudio)}) {
    for (int i = 0; i < 300; ++i) {
      std::string text = whole.substr(0, 1 + rng.below(static_cast<std::uint32_t>(whole.size())));
      text[rng.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(rng.below(256));
      try {
        read_foreign_cameras({whole == colmap_binary() ? "c.bin" : "c.yaml", text});
      } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace waymark
