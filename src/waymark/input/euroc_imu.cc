// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include "waymark/base/config.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/imu_readers.h"

namespace waymark {

std::optional<ImuStream> read_euroc_imu(const std::filesystem::path& folder) {
  const std::filesystem::path mav0 =
      std::filesystem::is_directory(folder / "mav0") ? folder / "mav0" : folder;
  const std::filesystem::path table = mav0 / "imu0" / "data.csv";
  if (!std::filesystem::is_regular_file(table)) return std::nullopt;
  ImuStream stream = read_imu_file(table);
  const auto config_of = [](const std::filesystem::path& path) {
    constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
    return parse_config({path.string(), read_text_file(path, "a YAML file", kMaxBytes)});
  };
  const std::filesystem::path sensor = table.parent_path() / "sensor.yaml";
  const bool has_sensor = std::filesystem::exists(sensor);
  if (has_sensor) stream.calibration.noise = read_imu_noise(config_of(sensor), "the IMU");
  if (has_sensor && std::filesystem::exists(mav0 / "cam0" / "sensor.yaml")) {
    stream.calibration.imu_from_rig = euroc_sensor_from_camera0(table);
  }
  // Of TUM-VI.
  const std::filesystem::path dso = (mav0 / ".." / "dso").lexically_normal();
  if (std::filesystem::exists(dso / "camchain.yaml")) {
    fill_in(stream.calibration, read_imu_calibration(config_of(dso / "camchain.yaml")));
  }
  if (!stream.calibration.noise && std::filesystem::exists(dso / "imu_config.yaml")) {
    stream.calibration.noise = read_imu_noise(config_of(dso / "imu_config.yaml"), "the IMU");
  }
  return stream;
}

}  // namespace waymark
