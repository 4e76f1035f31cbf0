// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/imu_readers.h"
#include "waymark/simulate/dataset.h"
#include "waymark/simulate/named_cameras.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

const Rigid3 kSideBySide(so3_exp({0.0, 0.05, 0.0}), {-0.11, 0.003, 0.001});

SequenceSpec inertial_spec(CameraChain chain) {
  SequenceSpec spec;
  spec.seed = 3;
  spec.num_frames = 3;
  spec.chain = std::move(chain);
  spec.imu = parse_imu({"mems", "shift=15", "turn_x=30", "turn_y=-80", "lever_z=-7"});
  return spec;
}

std::string file_text(const fs::path& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file.good()) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<std::vector<double>> number_rows(const fs::path& path) {
  std::istringstream text(file_text(path));
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(text, line);) {
    if (line[0] == '#') continue;
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');)
      rows.back().push_back(std::stod(field));
  }
  return rows;
}

Rigid3 kalibr_transform(const YAML::Node& rows) {
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = rows[i / 4][i % 4].as<double>();
  return rigid_from_matrix(matrix, "test", "transform");
}

double motion_between(const Rigid3& a, const Rigid3& b) { return (a * b.inverse()).log().norm(); }

/// The noise that a file states.
ImuNoise noise_in(const fs::path& file) {
  ConfigSource source = ConfigSource::from_file(file);
  source.key = "imu0";
  return *read_imu_calibration(parse_config(source)).noise;
}

/// imu.yaml and the mounting in camchain.yaml are those of the spec.
void expect_kalibr(const fs::path& folder, const SequenceSpec& spec) {
  const ImuNoise noise = noise_in(folder / "imu.yaml");
  EXPECT_EQ(noise.gyroscope, spec.imu->gyroscope.noise_density);
  EXPECT_EQ(noise.accelerometer_walk, spec.imu->accelerometer.random_walk);
  const YAML::Node chain = YAML::LoadFile((folder / "camchain.yaml").string());
  for (std::size_t i = 0; i < spec.chain.cameras.size(); ++i) {
    const YAML::Node camera = chain["cam" + std::to_string(i)];
    const Rigid3 imu_from_rig =
        kalibr_transform(camera["T_cam_imu"]).inverse() * spec.chain.cameras[i].cam_from_rig;
    EXPECT_LT(motion_between(imu_from_rig, *spec.imu->calibration().imu_from_rig), 1e-9);
    EXPECT_EQ(camera["timeshift_cam_imu"].as<double>(), 0.015);
  }
  const ConfigSource source = ConfigSource::from_file(folder / "camchain.yaml");
  EXPECT_EQ(read_camchain(parse_config(source))->cameras.size(), spec.chain.cameras.size());
}

void expect_samples(const fs::path& file, const SimulatedSequence& sequence) {
  const auto rows = number_rows(file);
  const std::vector<ImuSample> samples = sequence.imu_samples();
  ASSERT_EQ(rows.size(), samples.size());
  EXPECT_EQ(samples[100].timestamp_ns, sequence.timestamp_ns(0) + 15'000'000);
  EXPECT_EQ(samples.back().timestamp_ns,
            sequence.timestamp_ns(2) + 50'000'000 + 500'000'000 + 15'000'000);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 7u);
    EXPECT_EQ(static_cast<std::int64_t>(rows[i][0]), samples[i].timestamp_ns);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(rows[i][static_cast<std::size_t>(1 + axis)], samples[i].angular_velocity[axis]);
      EXPECT_EQ(rows[i][static_cast<std::size_t>(4 + axis)], samples[i].acceleration[axis]);
    }
  }
}

TEST(ImuDataset, EurocHasItsFolder) {
  const testing::TemporaryFolder folder;
  const CameraDescription camera = named_camera("perspective", 48);
  const SequenceSpec spec = inertial_spec(stereo_chain(camera, camera, kSideBySide));
  SimulatedSequence sequence(spec);
  write_dataset(sequence, folder.path());
  expect_samples(folder / "mav0" / "imu0" / "data.csv", sequence);
  expect_kalibr(folder.path(), spec);
  const YAML::Node sensor = YAML::LoadFile((folder / "mav0" / "imu0" / "sensor.yaml").string());
  EXPECT_EQ(sensor["sensor_type"].as<std::string>(), "imu");
  EXPECT_EQ(sensor["update_rate"].as<double>(), 200.0);
  EXPECT_EQ(sensor["gyroscope_noise_density"].as<double>(), 1.6968e-4);
  EXPECT_EQ(sensor["accelerometer_random_walk"].as<double>(), 3.0e-3);
  Eigen::Matrix4d body_from_imu;
  for (int i = 0; i < 16; ++i) body_from_imu(i / 4, i % 4) = sensor["T_BS"]["data"][i].as<double>();
  const Rigid3 rig_from_imu = rigid_from_matrix(body_from_imu, "test", "T_BS");
  EXPECT_LT(motion_between(rig_from_imu, spec.imu->calibration().imu_from_rig->inverse()), 1e-9);
  EXPECT_FALSE(fs::exists(folder / "calibration_true.yaml"));
}

TEST(ImuDataset, OthersHaveFilesBesideTheChain) {
  const CameraDescription fisheye = named_camera("fisheye", 48);
  for (const CameraChain& chain :
       {rgbd_chain(named_camera("perspective", 48), 5000.0), mono_chain(fisheye)}) {
    const testing::TemporaryFolder folder;
    const SequenceSpec spec = inertial_spec(chain);
    SimulatedSequence sequence(spec);
    write_dataset(sequence, folder.path());
    expect_samples(folder / "imu0.csv", sequence);
    expect_kalibr(folder.path(), spec);
    EXPECT_FALSE(fs::exists(folder / "mav0"));
  }
  const testing::TemporaryFolder folder;
  const SequenceSpec spec = inertial_spec(stereo_chain(fisheye, fisheye, kSideBySide));
  SimulatedSequence sequence(spec);
  write_dataset(sequence, folder.path());
  expect_samples(folder / "mav0" / "imu0" / "data.csv", sequence);
  expect_kalibr(folder.path(), spec);
  EXPECT_EQ(file_text(folder / "dso" / "imu_config.yaml"), file_text(folder / "imu.yaml"));
  EXPECT_EQ(file_text(folder / "dso" / "camchain.yaml"), file_text(folder / "camchain.yaml"));
}

TEST(ImuDataset, TellsAWrongCalibrationByTheAmountsAsked) {
  const testing::TemporaryFolder folder;
  SequenceSpec spec = inertial_spec(mono_chain(named_camera("perspective", 48)));
  spec.told = parse_calibration_error({"imu_turn=5", "imu_lever=3", "imu_shift=-4"});
  SimulatedSequence sequence(spec);
  write_dataset(sequence, folder.path());
  const YAML::Node told = YAML::LoadFile((folder / "camchain.yaml").string())["cam0"];
  const YAML::Node truth = YAML::LoadFile((folder / "calibration_true.yaml").string())["cam0"];
  const Rigid3 told_mounting = kalibr_transform(told["T_cam_imu"]);
  const Rigid3 true_mounting = kalibr_transform(truth["T_cam_imu"]);
  EXPECT_NEAR(told_mounting.rotation.angularDistance(true_mounting.rotation),
              5.0 * std::numbers::pi / 180.0,
              1e-9);
  EXPECT_NEAR((told_mounting.translation - true_mounting.translation).norm(), 0.03, 1e-9);
  EXPECT_NEAR(told["timeshift_cam_imu"].as<double>(), 0.011, 1e-12);
  EXPECT_EQ(truth["timeshift_cam_imu"].as<double>(), 0.015);
}

TEST(ImuDataset, TellsNothingOrOfNothing) {
  const testing::TemporaryFolder folder;
  SequenceSpec spec = inertial_spec(mono_chain(named_camera("perspective", 48)));
  spec.told = parse_calibration_error({"imu=none"});
  SimulatedSequence sequence(spec);
  write_dataset(sequence, folder.path());
  EXPECT_TRUE(fs::exists(folder / "mav0" / "imu0" / "data.csv"));
  for (const char* name : {"imu.yaml", "mav0/imu0/sensor.yaml"}) {
    EXPECT_FALSE(fs::exists(folder / name)) << name;
  }
  EXPECT_EQ(file_text(folder / "camchain.yaml"), format_camchain(spec.chain));
  EXPECT_NE(file_text(folder / "calibration_true.yaml").find("T_cam_imu"), std::string::npos);
  EXPECT_THROW(told_imu({}, parse_calibration_error({"imu_turn=5"})), InputError);
  EXPECT_THROW(told_imu({}, parse_calibration_error({"imu=none"})), InputError);
  EXPECT_FALSE(told_imu({}, {}).noise);
  // Without an IMU there is nothing of one, and the images are the same.
  const testing::TemporaryFolder without;
  const std::vector<std::uint8_t> image = sequence.frame(1).images[0].values;
  spec.imu.reset();
  spec.told = {};
  SimulatedSequence plain(spec);
  write_dataset(plain, without.path());
  EXPECT_EQ(plain.frame(1).images[0].values, image);
  for (const auto& entry : fs::recursive_directory_iterator(without.path())) {
    EXPECT_EQ(entry.path().string().find("imu"), std::string::npos) << entry.path();
  }
}

}  // namespace
}  // namespace waymark
