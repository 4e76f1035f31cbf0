// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <numeric>

namespace waymark {

/// The stages of tracking one frame, in order.
enum class Stage {
  kFeatures,    ///< Pyramid, corners, descriptors, bearings.
  kDepth,       ///< Stereo search or depth sampling.
  kWait,        ///< Waiting for the mapper; not part of the tracking time.
  kPredict,     ///< Matching to the last frame and the first pose.
  kLocalMap,    ///< Matching to the local map and the final pose.
  kInitialize,  ///< Two-view initialisation.
  kRecover,     ///< Recovery after loss.
  kKeyframe,    ///< Decision, hand-over.
};
inline constexpr std::size_t kNumStages = 8;  ///< Number of stages.
/// Names of the stages, as in result files.
inline constexpr std::array<const char*, kNumStages> kStageNames = {
    "features", "depth", "wait", "predict", "local_map", "initialize", "recover", "keyframe"};

/// Milliseconds spent in each stage of one frame.
struct StageTimes {
  std::array<double, kNumStages> ms{};  ///< In the order of Stage.

  /// Milliseconds of one stage.
  double& operator[](Stage stage) { return ms[static_cast<std::size_t>(stage)]; }
  /// Milliseconds of one stage.
  double operator[](Stage stage) const { return ms[static_cast<std::size_t>(stage)]; }

  /// From image in memory to pose returned, less the waiting for the mapper.
  double tracking_ms() const {
    return std::accumulate(ms.begin(), ms.end(), 0.0) - (*this)[Stage::kWait];
  }
};

/// Adds the time of its scope to a stage.
class StageTimer {
 public:
  /// times must outlive the timer.
  StageTimer(StageTimes& times, Stage stage)
      : times_(times), stage_(stage), start_(std::chrono::steady_clock::now()) {}
  ~StageTimer() {
    times_[stage_] +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
            .count();
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  StageTimes& times_;
  Stage stage_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace waymark
