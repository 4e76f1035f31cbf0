// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The readers of settings, calibrations, lists of images and inertial data. The first byte of the
// input, a digit, says which.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/base/settings.h"
#include "waymark/camera/camchain.h"
#include "waymark/features/frame_builder.h"
#include "waymark/input/config_file.h"
#include "waymark/input/foreign_calibration.h"
#include "waymark/input/image_times.h"
#include "waymark/input/imu_readers.h"

namespace {

using waymark::CameraChain;
using waymark::ConfigSource;

CameraChain read_own(const ConfigSource& source) {
  const waymark::ConfigNode config = waymark::parse_config(source);
  waymark::FeatureSettings settings;
  waymark::read_settings(settings, config);
  return waymark::read_camchain(config).value_or(CameraChain());
}

CameraChain read_any(const ConfigSource& source) {
  return waymark::read_foreign_cameras(source).value_or(CameraChain());
}

CameraChain read_list(const ConfigSource& source) {
  const waymark::ImageList list = waymark::parse_image_list(source.text, source.name);
  waymark::times_in_names(list.images);
  return {};
}

void check(const waymark::ImuStream& stream) {
  for (std::size_t i = 1; i < stream.samples.size(); ++i) {
    WAYMARK_CHECK(stream.samples[i - 1].timestamp_ns < stream.samples[i].timestamp_ns);
  }
  waymark::format_imu(stream, {0, 1'000'000'000});
}

CameraChain read_imu_table(const ConfigSource& source) {
  const waymark::ImuTable table = waymark::parse_imu_table(source.text, "gyro.csv");
  check(waymark::merge_imu(table.gyroscope, table.accelerometer, source.name));
  return {};
}

CameraChain read_telemetry(const ConfigSource& source) {
  const std::array<waymark::TelemetryPacket, 2> packets = {
      {{0.0, 1.0, source.text}, {1.0, 0.5, source.text}}};
  if (const auto stream = waymark::imu_of_gopro(packets, source.name)) check(*stream);
  return {};
}

constexpr std::array kReaders = {read_own,
                                 waymark::read_opencv_calibration,
                                 waymark::read_ros_calibration,
                                 waymark::read_colmap_calibration,
                                 waymark::read_nerfstudio_calibration,
                                 read_any,
                                 read_list,
                                 read_imu_table,
                                 read_telemetry};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto reader = static_cast<std::size_t>(data[0] - '0') % kReaders.size();
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const CameraChain chain = kReaders[reader]({"fuzz", text});
    if (!chain.cameras.empty()) waymark::make_rig(chain);
  } catch (const waymark::InputError& error) {
    WAYMARK_CHECK(std::string_view(error.what()).find("\n") == std::string_view::npos);
  }
  return 0;
}
