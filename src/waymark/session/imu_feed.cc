// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/imu_feed.h"

#include <cmath>
#include <utility>

#include "waymark/geometry/rigid3.h"

namespace waymark {

ImuFeed::ImuFeed(std::shared_ptr<const ImuStream> stream, System& system) : system_(system) {
  if (!stream) return;
  fault_ = fault_of(*stream);
  if (!fault_.empty()) return;
  system.set_imu(stream->calibration);
  stream_ = std::move(stream);
}

void ImuFeed::feed_until(std::int64_t timestamp_ns) {
  constexpr std::int64_t kMaxShiftNs = 100'000'000;
  while (stream_ && next_ < stream_->samples.size() &&
         stream_->samples[next_].timestamp_ns <= timestamp_ns + kMaxShiftNs) {
    system_.feed_imu(stream_->samples[next_++]);
  }
}

std::optional<ImuSummary> ImuFeed::summarize(const FedFrames& frames) const {
  ImuSummary summary;
  summary.reason = fault_;
  if (!fault_.empty()) return summary;
  const std::optional<InertialReport>& report = system_.inertial();
  if (!report) return std::nullopt;
  constexpr double kDegrees = 180.0 / M_PI;
  summary.is_used = report->is_used;
  summary.reason = report->reason;
  if (report->metric_from && report->metric_from->value < frames.fed.size()) {
    summary.metric_from = frames.table.frames[frames.fed[report->metric_from->value]].index;
  }
  summary.scale_sigma = report->scale_sigma;
  summary.gravity_in_world = report->gravity_in_world;
  summary.gravity_sigma_deg = kDegrees * report->gravity_sigma_rad;
  summary.time_shift_ms = 1e3 * report->time_shift_s;
  summary.time_shift_sigma_ms = 1e3 * report->time_shift_sigma_s;
  summary.rotation_deg = kDegrees * so3_log(report->imu_from_rig.rotation);
  summary.rotation_sigma_deg = kDegrees * report->rotation_sigma_rad;
  summary.lever_arm_m = report->imu_from_rig.translation;
  summary.lever_arm_sigma_m = report->lever_arm_sigma_m;
  summary.gyro_bias = report->biases.gyroscope;
  summary.accel_bias = report->biases.accelerometer;
  return summary;
}

}  // namespace waymark
