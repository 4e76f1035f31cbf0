// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <memory>
#include <memory_resource>
#include <optional>
#include <utility>
#include <variant>

#include "waymark/loop/global_mapper.h"
#include "waymark/simulate/testing/town_recording.h"
#include "waymark/track/testing/tracked.h"

namespace waymark {

/// Tracker, mapper and global adjustments on the features of a town's frames: what a session does
/// behind extraction, on one thread. What is found out shows in the next frame.
class TownSession {
 public:
  static constexpr std::int64_t kFramePeriodNs = 50'000'000;

  /// Processor time of a frame in seconds, of all threads.
  struct Times {
    double track_s = 0.0;
    double map_s = 0.0;     ///< 0 where it became no keyframe.
    double adjust_s = 0.0;  ///< Of everything; 0 where that was not due.
  };

  /// first_ns: timestamp of the first frame; one comes every kFramePeriodNs.
  TownSession(std::shared_ptr<const Rig> rig, bool has_range, std::int64_t first_ns = 0)
      : tracker_(has_range, TrackingSettings{}, 1),
        mapper_(rig, MappingSettings{}, LoopSettings{}, {.refine = "off"}, 1),
        visible_(mapper_.snapshot()),
        first_ns_(first_ns) {}

  /// Goes on in a map made before.
  void begin_in(const MapSnapshot& before) {
    mapper_.take_over(before);
    visible_ = mapper_.snapshot();
    tracker_.begin_in(*visible_.map, TrackingPurpose::kMapping);
    before.map->keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
      num_frames_ = std::max(num_frames_, keyframe.frame.value + 1);
    });
  }

  Tracked track(const TownFrame& seen) {
    const std::int64_t timestamp_ns = first_ns_ + kFramePeriodNs * num_frames_;
    const Frame frame{FrameId{num_frames_}, timestamp_ns, seen.features};
    ++num_frames_;
    Tracked outcome;
    times_ = {};
    add_time(times_.track_s, [&] { outcome.message = tracker_.track(frame, visible_, outcome); });
    if (!outcome.message) return outcome;
    add_time(times_.map_s, [&] {
      std::visit([&](const auto& message) { mapper_.add(message); }, *outcome.message);
    });
    if (const std::optional<AdjustmentTask> task = mapper_.take_task()) {
      add_time(times_.adjust_s, [&] { mapper_.apply(*task, task->adjust()); });
    }
    add_time(times_.map_s, [&] { visible_ = mapper_.snapshot(); });
    return outcome;
  }

  /// Of the frame that was tracked last.
  const Times& times() const { return times_; }
  /// See GlobalMapper; before the first frame.
  void keep_in(const std::shared_ptr<std::pmr::memory_resource>& memory) {
    mapper_.keep_in(memory);
  }

  void finish() {
    mapper_.finish();
    visible_ = mapper_.snapshot();
  }

  const Map& map() const { return *visible_.map; }
  const MapSnapshot& snapshot() const { return visible_; }
  int num_loops() const { return mapper_.num_loops(); }

 private:
  template <class Step>
  static void add_time(double& seconds, const Step& step) {
    const std::clock_t before = std::clock();
    step();
    seconds += static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  }

  Tracker tracker_;
  GlobalMapper mapper_;
  MapSnapshot visible_;
  std::int64_t first_ns_;
  Times times_;
  std::uint32_t num_frames_ = 0;
};

}  // namespace waymark
