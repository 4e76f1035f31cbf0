// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "waymark/input/imu_stream.h"
#include "waymark/results/results.h"
#include "waymark/session/frame_feed.h"
#include "waymark/system/system.h"

namespace waymark {

/// Feeds what the IMU of an input measured, in step with its images, unless it cannot be used.
class ImuFeed {
 public:
  /// stream: null where there is none.
  ImuFeed(std::shared_ptr<const ImuStream> stream, System& system);

  /// All before an image, and as much more as clocks may be apart.
  void feed_until(std::int64_t timestamp_ns);

  /// What became of it; after System::finish(). frames: which rows those of the system have, by
  /// which metric_from is then.
  std::optional<InertialReport> report(const FedFrames& frames) const;

 private:
  System& system_;
  std::shared_ptr<const ImuStream> stream_;  ///< Null where it is not used.
  std::string fault_;
  std::size_t next_ = 0;
};

}  // namespace waymark
