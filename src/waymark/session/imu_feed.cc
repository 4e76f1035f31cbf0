// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/imu_feed.h"

#include <utility>

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

std::optional<InertialReport> ImuFeed::report(const FedFrames& frames) const {
  InertialReport report;
  report.reason = fault_;
  if (!fault_.empty()) return report;
  if (!system_.inertial()) return std::nullopt;
  report = *system_.inertial();
  if (report.metric_from && report.metric_from->value < frames.fed.size()) {
    report.metric_from->value = frames.table.frames[frames.fed[report.metric_from->value]].index;
  }
  return report;
}

}  // namespace waymark
