// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "waymark/imu/imu.h"

namespace waymark {

/// Whether samples tell what happened in a stretch of time.
enum class ImuCoverage {
  kWhole,
  kOutside,  ///< It begins before the first sample or ends after the last.
  kGap,      ///< Samples are missing in it.
};

/// A stream of samples in the order of time. Nothing is told across a gap, which is longer than
/// five median periods.
class ImuSamples {
 public:
  /// Appends a sample, unless it is not later than the last one or not finite: returns whether it
  /// was taken. Such samples are counted and left out.
  bool add(const ImuSample& sample);
  /// Samples that add() left out.
  std::size_t num_rejected() const { return num_rejected_; }

  /// Those taken.
  std::span<const ImuSample> all() const { return samples_; }

  /// Median of the last hundred or so; 0 before there are two samples.
  std::int64_t period_ns() const { return period_ns_; }

  /// Whether samples tell all from begin_ns to end_ns (not before begin_ns).
  ImuCoverage coverage(std::int64_t begin_ns, std::int64_t end_ns) const;
  /// Linear between the neighbours; nothing outside of the samples and in gaps.
  std::optional<ImuSample> at(std::int64_t timestamp_ns) const;
  /// Samples from begin_ns to end_ns (> begin_ns), with one interpolated at either end: at least
  /// two, or none if they do not tell all of it.
  std::vector<ImuSample> between(std::int64_t begin_ns, std::int64_t end_ns) const;

  /// Forgets what is not needed to interpolate at this time or later.
  void drop_before(std::int64_t timestamp_ns);

 private:
  std::size_t first_from(std::int64_t timestamp_ns) const;
  bool is_gap(std::size_t after) const;
  ImuSample interpolate(std::size_t after, std::int64_t timestamp_ns) const;
  void update_period();

  std::vector<ImuSample> samples_;
  std::int64_t period_ns_ = 0;
  std::size_t num_rejected_ = 0;
  std::size_t num_since_period_ = 0;
};

}  // namespace waymark
