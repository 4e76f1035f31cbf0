// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_samples.h"

#include <algorithm>

#include "waymark/base/check.h"
#include "waymark/base/median.h"

namespace waymark {
namespace {

/// The median of so many periods is not moved by gaps among them; it is updated as often.
constexpr std::size_t kNumPeriods = 100;
constexpr double kMaxGapPeriods = 5.0;

}  // namespace

bool ImuSamples::add(const ImuSample& sample) {
  const bool is_late = !samples_.empty() && sample.timestamp_ns <= samples_.back().timestamp_ns;
  if (is_late || !sample.angular_velocity.allFinite() || !sample.acceleration.allFinite()) {
    ++num_rejected_;
    return false;
  }
  samples_.push_back(sample);
  ++num_since_period_;
  if (samples_.size() <= kNumPeriods || num_since_period_ >= kNumPeriods) update_period();
  return true;
}

void ImuSamples::update_period() {
  num_since_period_ = 0;
  std::vector<std::int64_t> periods;
  const std::size_t first = samples_.size() > kNumPeriods ? samples_.size() - kNumPeriods : 1;
  for (std::size_t i = first; i < samples_.size(); ++i) {
    periods.push_back(samples_[i].timestamp_ns - samples_[i - 1].timestamp_ns);
  }
  if (!periods.empty()) period_ns_ = median(periods);
}

/// Index of the first sample at this time or later.
std::size_t ImuSamples::first_from(std::int64_t timestamp_ns) const {
  const auto found = std::ranges::lower_bound(samples_, timestamp_ns, {}, &ImuSample::timestamp_ns);
  return static_cast<std::size_t>(found - samples_.begin());
}

bool ImuSamples::is_gap(std::size_t after) const {
  const std::int64_t period = samples_[after].timestamp_ns - samples_[after - 1].timestamp_ns;
  return static_cast<double>(period) > kMaxGapPeriods * static_cast<double>(period_ns_);
}

ImuCoverage ImuSamples::coverage(std::int64_t begin_ns, std::int64_t end_ns) const {
  WAYMARK_CHECK(begin_ns <= end_ns);
  if (samples_.empty() || begin_ns < samples_.front().timestamp_ns ||
      end_ns > samples_.back().timestamp_ns) {
    return ImuCoverage::kOutside;
  }
  std::size_t after = first_from(begin_ns);
  if (samples_[after].timestamp_ns == begin_ns) ++after;
  for (; after < samples_.size() && samples_[after - 1].timestamp_ns < end_ns; ++after) {
    if (is_gap(after)) return ImuCoverage::kGap;
  }
  return ImuCoverage::kWhole;
}

ImuSample ImuSamples::interpolate(std::size_t after, std::int64_t timestamp_ns) const {
  const ImuSample& b = samples_[after];
  if (b.timestamp_ns == timestamp_ns) return b;
  const ImuSample& a = samples_[after - 1];
  const double share = static_cast<double>(timestamp_ns - a.timestamp_ns) /
                       static_cast<double>(b.timestamp_ns - a.timestamp_ns);
  return {timestamp_ns,
          a.angular_velocity + share * (b.angular_velocity - a.angular_velocity),
          a.acceleration + share * (b.acceleration - a.acceleration)};
}

std::optional<ImuSample> ImuSamples::at(std::int64_t timestamp_ns) const {
  if (coverage(timestamp_ns, timestamp_ns) != ImuCoverage::kWhole) return std::nullopt;
  return interpolate(first_from(timestamp_ns), timestamp_ns);
}

std::vector<ImuSample> ImuSamples::between(std::int64_t begin_ns, std::int64_t end_ns) const {
  WAYMARK_CHECK(begin_ns < end_ns);
  if (coverage(begin_ns, end_ns) != ImuCoverage::kWhole) return {};
  const std::size_t first = first_from(begin_ns);
  const std::size_t last = first_from(end_ns);
  std::vector<ImuSample> samples = {interpolate(first, begin_ns)};
  const std::size_t next = samples_[first].timestamp_ns == begin_ns ? first + 1 : first;
  samples.insert(samples.end(), samples_.begin() + next, samples_.begin() + last);
  samples.push_back(interpolate(last, end_ns));
  return samples;
}

void ImuSamples::drop_before(std::int64_t timestamp_ns) {
  const std::size_t first = first_from(timestamp_ns);
  const bool is_exact = first < samples_.size() && samples_[first].timestamp_ns == timestamp_ns;
  const std::size_t num_dropped = is_exact ? first : std::max<std::size_t>(first, 1) - 1;
  samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(num_dropped));
}

}  // namespace waymark
