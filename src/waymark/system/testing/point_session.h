// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <malloc.h>

#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/loop/global_mapper.h"
#include "waymark/match/testing/scene.h"
#include "waymark/track/testing/tracked.h"

namespace waymark {

/// Tracker and mapper by hand, the map being visible in the frame after each message, on what a rig
/// sees of a cloud of points.
class PointSession {
 public:
  PointSession(int num_cameras, PointCloud cloud)
      : rig_(make_test_rig(num_cameras)),
        cloud_(std::move(cloud)),
        tracker_(num_cameras > 1, TrackingSettings{}, 1),
        mapper_(rig_, MappingSettings{}, LoopSettings{}, CalibrationSettings{}, 1),
        visible_(mapper_.snapshot()) {}

  /// From now on the frames are a few noisy looks from a place, which are made once.
  void look_from(const Rigid3& world_from_rig, int num_views) {
    views_.clear();
    for (int i = 0; i < num_views; ++i) {
      views_.push_back(observe(cloud_, rig_, world_from_rig, noise_, num_looks_++).features);
    }
  }

  /// What there is to see from now on.
  void show(PointCloud cloud) { cloud_ = std::move(cloud); }

  Tracked track() {
    const Frame frame{FrameId{num_frames_},
                      50'000'000 * std::int64_t{num_frames_},
                      views_[num_frames_ % views_.size()]};
    ++num_frames_;
    Tracked outcome;
    outcome.message = tracker_.track(frame, visible_, outcome);
    if (outcome.message) {
      std::visit([&](const auto& message) { mapper_.add(message); }, *outcome.message);
      visible_ = mapper_.snapshot();
    }
    return outcome;
  }

  std::vector<TransferredScale> kept_scales() const { return tracker_.kept_scales(map()); }

  const Map& map() const { return *visible_.map; }

 private:
  std::shared_ptr<const Rig> rig_;
  PointCloud cloud_;
  PointNoise noise_{.seed = 4, .max_features = 250};
  Tracker tracker_;
  GlobalMapper mapper_;
  MapSnapshot visible_;
  std::vector<std::shared_ptr<const Features>> views_;
  std::uint64_t num_looks_ = 0;
  std::uint32_t num_frames_ = 0;
};

/// Bytes that are allocated now; 0 where a sanitizer has its own allocator.
inline std::size_t bytes_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace waymark
