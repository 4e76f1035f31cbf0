// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/dataset.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/simulate/video_compression.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

CameraDescription small_camera(double shift) {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {90.0 + shift, 91.0, 59.5 + shift, 44.25};
  camera.distortion_model = "radtan";
  camera.distortion_coeffs = {-0.1, 0.01, 0.0002, 0.0001};
  camera.width_px = 120;
  camera.height_px = 90;
  return camera;
}

const Rigid3 kCam1FromCam0(Eigen::Quaterniond(Eigen::AngleAxisd(0.07, Eigen::Vector3d::UnitY())),
                           {-0.11, 0.003, 0.001});

SequenceSpec small_spec(CameraChain chain) {
  SequenceSpec spec;
  spec.seed = 3;
  spec.num_frames = 3;
  spec.chain = std::move(chain);
  return spec;
}

/// Rows of words, without comments; commas separate words too.
std::vector<std::vector<std::string>> rows_of(const fs::path& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file.good()) << path;
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream words(line);
    rows.emplace_back();
    for (std::string word; words >> word;) rows.back().push_back(word);
  }
  return rows;
}

void expect_truth(const fs::path& folder, const SimulatedSequence& sequence) {
  const auto rows = rows_of(folder / "groundtruth.txt");
  ASSERT_EQ(rows.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const std::vector<std::string>& row = rows[static_cast<std::size_t>(i)];
    ASSERT_EQ(row.size(), 8u);
    EXPECT_NEAR(std::stod(row[0]), 1.0 + 0.05 * i, 1e-9);
    const Rigid3 truth = sequence.world_from_rig(i);
    const Eigen::Vector3d position(std::stod(row[1]), std::stod(row[2]), std::stod(row[3]));
    EXPECT_LT((position - truth.translation).norm(), 1e-6);
    const Eigen::Quaterniond rotation(
        std::stod(row[7]), std::stod(row[4]), std::stod(row[5]), std::stod(row[6]));
    EXPECT_LT(rotation.angularDistance(truth.rotation), 1e-6);
  }
}

void expect_image(const fs::path& path, const Image& image) {
  const cv::Mat mat = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  ASSERT_FALSE(mat.empty()) << path;
  ASSERT_EQ(mat.type(), CV_8UC1);
  ASSERT_TRUE(mat.isContinuous());
  EXPECT_EQ(std::vector<std::uint8_t>(mat.datastart, mat.dataend), image.values);
}

Eigen::Matrix4d matrix_of(const YAML::Node& numbers) {
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = numbers[i].as<double>();
  return matrix;
}

TEST(Dataset, StereoIsEuroc) {
  const testing::TemporaryFolder folder;
  SimulatedSequence sequence(
      small_spec(stereo_chain(small_camera(0.0), small_camera(3.0), kCam1FromCam0)));
  std::vector<int> done;
  write_dataset(sequence, folder.path(), [&](int frame) { done.push_back(frame); });
  EXPECT_EQ(done, (std::vector<int>{0, 1, 2}));
  expect_truth(folder.path(), sequence);
  for (std::size_t camera = 0; camera < 2; ++camera) {
    const fs::path sensor = folder / "mav0" / ("cam" + std::to_string(camera));
    const auto rows = rows_of(sensor / "data.csv");
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[1][0], "1050000000");
    expect_image(sensor / "data" / rows[1][1], sequence.frame(1).images[camera]);
    const YAML::Node yaml = YAML::LoadFile((sensor / "sensor.yaml").string());
    EXPECT_EQ(yaml["camera_model"].as<std::string>(), "pinhole");
    EXPECT_EQ(yaml["distortion_model"].as<std::string>(), "radial-tangential");
    EXPECT_EQ(yaml["intrinsics"][0].as<double>(), camera == 0 ? 90.0 : 93.0);
    EXPECT_EQ(yaml["distortion_coefficients"][0].as<double>(), -0.1);
    EXPECT_EQ(yaml["resolution"][1].as<int>(), 90);
    const Rigid3 cam_from_rig = camera == 0 ? Rigid3() : kCam1FromCam0;
    const Eigen::Matrix4d body_from_sensor = matrix_of(yaml["T_BS"]["data"]);
    EXPECT_LT((body_from_sensor - cam_from_rig.inverse().matrix()).norm(), 1e-12);
  }
}

TEST(Dataset, RgbdIsTum) {
  const testing::TemporaryFolder folder;
  SimulatedSequence sequence(small_spec(rgbd_chain(small_camera(0.0), 5000.0)));
  write_dataset(sequence, folder.path());
  expect_truth(folder.path(), sequence);
  const auto colour = rows_of(folder / "rgb.txt");
  const auto depth = rows_of(folder / "depth.txt");
  ASSERT_EQ(colour.size(), 3u);
  ASSERT_EQ(depth.size(), 3u);
  EXPECT_EQ(colour[2][0], "1.100000000");
  EXPECT_EQ(depth[2][0], colour[2][0]);
  const SimulatedFrame frame = sequence.frame(2);
  expect_image(folder / colour[2][1], frame.images[0]);
  const cv::Mat mat = cv::imread((folder / depth[2][1]).string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(mat.type(), CV_16UC1);
  EXPECT_TRUE(
      std::equal(mat.begin<std::uint16_t>(), mat.end<std::uint16_t>(), frame.depth.values.begin()));
}

TEST(Dataset, TellsAWrongCalibrationAndKeepsTheTrueOne) {
  const testing::TemporaryFolder folder;
  SequenceSpec spec = small_spec(stereo_chain(small_camera(0.0), small_camera(3.0), kCam1FromCam0));
  SimulatedSequence truth(spec);
  write_dataset(truth, folder / "truth");
  EXPECT_FALSE(fs::exists(folder / "truth" / "calibration_true.yaml"));
  spec.told = {.focal = 1.05, .turn_mrad = {0.0, 2.0, 0.0}};
  SimulatedSequence sequence(spec);
  write_dataset(sequence, folder / "told");
  const fs::path told = folder / "told";
  EXPECT_DOUBLE_EQ(YAML::LoadFile(told / "camchain.yaml")["cam0"]["intrinsics"][0].as<double>(),
                   94.5);
  EXPECT_EQ(YAML::LoadFile(told / "calibration_true.yaml")["cam0"]["intrinsics"][0].as<double>(),
            90.0);
  const YAML::Node sensor = YAML::LoadFile(told / "mav0" / "cam1" / "sensor.yaml");
  EXPECT_DOUBLE_EQ(sensor["intrinsics"][0].as<double>(), 1.05 * 93.0);
  const Eigen::Matrix4d body_from_sensor = matrix_of(sensor["T_BS"]["data"]);
  const Eigen::Matrix3d turn = (body_from_sensor * kCam1FromCam0.matrix()).topLeftCorner<3, 3>();
  EXPECT_NEAR(std::acos(0.5 * (turn.trace() - 1.0)), 2e-3, 1e-6);
  expect_image(told / "mav0" / "cam1" / "data" / "1000000000.png", truth.frame(0).images[1]);
}

TEST(Dataset, CompressesEachCameraByItself) {
  const testing::TemporaryFolder folder;
  SequenceSpec spec = small_spec(stereo_chain(small_camera(0.0), small_camera(3.0), kCam1FromCam0));
  spec.compressed_kbit_per_s = 200.0;
  SimulatedSequence sequence(spec);
  write_dataset(sequence, folder.path());
  for (std::size_t camera = 0; camera < 2; ++camera) {
    VideoCompression compression(spec.compressed_kbit_per_s, spec.rate_hz);
    const fs::path data = folder / "mav0" / ("cam" + std::to_string(camera)) / "data";
    for (int i = 0; i < 3; ++i) {
      const Image rendered = sequence.frame(i).images[camera];
      const Image read = compression.compress(rendered);
      EXPECT_NE(read.values, rendered.values);
      expect_image(data / (std::to_string(sequence.timestamp_ns(i)) + ".png"), read);
    }
  }
}

TEST(Dataset, DepthHasTimesOfItsOwn) {
  const testing::TemporaryFolder folder;
  SequenceSpec spec = small_spec(rgbd_chain(small_camera(0.0), 5000.0));
  spec.depth_lag_s = 0.006;
  SimulatedSequence sequence(spec);
  write_dataset(sequence, folder.path());
  EXPECT_EQ(rows_of(folder / "rgb.txt")[2][0], "1.100000000");
  EXPECT_EQ(rows_of(folder / "depth.txt")[2][0], "1.106000000");
  EXPECT_TRUE(fs::exists(folder / rows_of(folder / "depth.txt")[2][1]));
}

TEST(Dataset, UnwritableFoldersAreNamed) {
  const testing::TemporaryFolder folder;
  const fs::path file = folder.write("file", "x");
  SimulatedSequence sequence(small_spec(mono_chain(small_camera(0.0))));
  EXPECT_THROW(write_dataset(sequence, file / "below"), OutputError);
}

}  // namespace
}  // namespace waymark
