// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/session/depth_check.h"
#include "waymark/session/map_depth_check.h"
#include "waymark/session/pair_check.h"
#include "waymark/session/session_options.h"
#include "waymark/system/system.h"

namespace waymark {

/// Looks for usual mistakes in the calibration while a session runs, and names each once, with its
/// cure: see calibration_advice.h, PairCheck and DepthCheck. Takes no part in the session.
class CalibrationMonitor {
 public:
  /// Hears of each mistake when it is found, in one line.
  using Listener = std::function<void(const std::string&)>;

  /// Names what the numbers alone tell.
  CalibrationMonitor(const PreparedInput& input, Listener listener);

  /// Of a session that goes on in a map, before its first frame.
  void compare_with(std::shared_ptr<const Map> map);

  /// Of each frame of the input, in order.
  void add_time(std::size_t index, std::int64_t timestamp_ns);
  /// Of each frame that was just fed to the system.
  void add(const FrameImages& images, const TrackingResult& result, const System& system);
  /// After the last frame.
  void finish();

  /// In the order they were found.
  const std::vector<std::string>& mistakes() const { return mistakes_; }

 private:
  void report(const std::optional<std::string>& mistake);
  void decide_on_times();
  void decide_on_pair();
  void decide_on_depth();

  Listener listener_;
  std::vector<std::string> mistakes_;
  Rig rig_;
  double units_per_metre_;
  int num_fed_ = 0;
  std::optional<std::pair<std::size_t, std::int64_t>> last_time_;
  std::vector<double> intervals_ns_;
  // Nothing once they have decided.
  std::optional<PairCheck> pair_;
  std::optional<DepthCheck> depth_;
  std::optional<MapDepthCheck> map_depth_;
  bool are_times_known_ = false;
};

}  // namespace waymark
