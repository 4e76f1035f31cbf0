// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/imu_readers.h"

namespace waymark {

void take_imu(const InputOptions& options,
              const std::function<std::optional<ImuStream>()>& carried,
              InputInfo& info) {
  std::optional<ImuStream> stream;
  if (options.imu == "none") return;
  if (!options.imu.empty()) {
    stream = read_imu_file(options.imu);
  } else {
    try {
      stream = carried();
    } catch (const InputError& error) {
      info.lines.push_back(fmt::format("note: inertial data are left out: {}", error.what()));
    }
  }
  if (!stream) return;
  ImuCalibration calibration = options.imu_calibration;
  fill_in(calibration, stream->calibration);
  stream->calibration = calibration;
  // No recording is that long.
  constexpr std::int64_t kDayNs = 86'400'000'000'000;
  const std::int64_t first_ns = stream->samples.front().timestamp_ns;
  if (info.format == "video" && info.times_ns.empty() && first_ns > kDayNs) {
    stream->notes.push_back(
        fmt::format("note: times of the video begin at 0, these at {} s: another clock",
                    format_seconds(first_ns)));
  }
  info.lines.push_back(fmt::format(
      "inertial data: {} of {}", count_of(stream->samples.size(), "sample"), stream->source));
  info.imu = std::make_shared<const ImuStream>(*std::move(stream));
}

void turn_imu(InputInfo& info, int num_quarters) {
  if (!info.imu || !info.imu->calibration.imu_from_rig) return;
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(-0.5 * std::numbers::pi * num_quarters, Eigen::Vector3d::UnitZ()));
  ImuStream turned = *info.imu;
  Rigid3& imu_from_rig = *turned.calibration.imu_from_rig;
  imu_from_rig = imu_from_rig * Rigid3(turn, Eigen::Vector3d::Zero());
  info.imu = std::make_shared<const ImuStream>(std::move(turned));
}

}  // namespace waymark
