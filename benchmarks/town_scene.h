// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>
#include <malloc.h>

#include <cstddef>
#include <cstdint>

#include "memory.h"
#include "waymark/map/correction.h"
#include "waymark/place/map_snapshot.h"
#include "waymark/simulate/testing/town_map.h"

namespace waymark {

/// A town with all that the steps need.
struct TownScene {
  TownMapSettings settings;
  TownMap town;
  MapSnapshot snapshot;
};

/// The last one that was asked for is kept.
const TownScene& scene_of(std::size_t num_keyframes, bool is_closed);
const TownScene& closed_scene(const benchmark::State& state);

/// The peak of memory during a step beyond what was there before it.
class PeakCounter {
 public:
  explicit PeakCounter(benchmark::State& state) : state_(state) {
    malloc_trim(0);
    reset_peak();
    before_mb_ = memory_mb("VmRSS");
  }
  ~PeakCounter() {
    state_.counters["peak_kb"] =
        1024.0 * (memory_mb("VmHWM") - before_mb_) / static_cast<double>(state_.range(0));
  }
  PeakCounter(const PeakCounter&) = delete;
  PeakCounter& operator=(const PeakCounter&) = delete;

 private:
  benchmark::State& state_;
  double before_mb_;
};

/// A correction that leaves every keyframe where it is.
MapCorrection small_correction(const Map& map);

using TownStep = void (*)(benchmark::State& state);
/// num_iterations: 0 for as many as it takes to know.
void add_step(const char* name, TownStep step, std::int64_t num_keyframes, int num_iterations);

}  // namespace waymark
