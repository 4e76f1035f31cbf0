// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// How the steps of mapping grow with the map, on towns of 1000 to 100 000 keyframes:
//   waymark_town_benchmark --benchmark_filter='/1000(/|$)'
// Names are WHAT/STEP/KEYFRAMES. "all" steps go over all of the map and are linear at best; "one"
// steps are about one place and would at best not depend on the map. Memory is in kB per keyframe.
// script/evaluate --table large makes a table of it. One process per size: what one leaves in the
// allocator is memory of the next.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "memory.h"
#include "town_loops.h"
#include "town_saving.h"
#include "town_scene.h"
#include "waymark/base/rng.h"
#include "waymark/loop/close.h"
#include "waymark/loop/find.h"
#include "waymark/loop/global_mapper.h"
#include "waymark/loop/loop_pose_graph.h"
#include "waymark/loop/spatial_neighbours.h"
#include "waymark/map/parts.h"
#include "waymark/simulate/testing/town_map.h"
#include "waymark/simulate/testing/town_session.h"

namespace waymark {
namespace {

/// Keyframes here and there, the same in every run.
class SomeKeyframes {
 public:
  explicit SomeKeyframes(const TownScene& scene)
      : count_(static_cast<std::uint32_t>(scene.settings.num_keyframes)) {}
  KeyframeId next() { return KeyframeId{rng_.below(count_)}; }

 private:
  Rng rng_{1, 0};
  std::uint32_t count_;
};

void make_map(benchmark::State& state) {
  malloc_trim(0);
  const double before_mb = memory_mb("VmRSS");
  for (auto _ : state) benchmark::DoNotOptimize(&closed_scene(state));
  const TownScene& scene = closed_scene(state);
  const auto num_keyframes = static_cast<double>(state.range(0));
  const Map& map = *scene.town.map;
  double num_observations = 0.0;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    num_observations += static_cast<double>(landmark.observations.size());
  });
  state.counters["map_kb"] = 1024.0 * (memory_mb("VmRSS") - before_mb) / num_keyframes;
  state.counters["places_kb"] =
      static_cast<double>(scene.snapshot.places->num_bytes()) / 1024.0 / num_keyframes;
  state.counters["landmarks"] = static_cast<double>(map.landmarks().size()) / num_keyframes;
  state.counters["observations"] = num_observations / num_keyframes;
  state.counters["loops"] = static_cast<double>(map.measured_loop_edges().size());
}

void make_frame(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  TownMapSettings settings = scene.settings;
  settings.max_features = 600;
  const TownRecording recording = make_town_recording(scene.town.town, scene.town.rig, settings, 0);
  SomeKeyframes some(scene);
  for (auto _ : state) benchmark::DoNotOptimize(recording.frame(some.next().value));
}

void index_places(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  for (auto _ : state) benchmark::DoNotOptimize(index_map(scene.town.map));
}

void find_place(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  SomeKeyframes some(scene);
  for (auto _ : state) {
    const Features& features = *scene.town.map->keyframes().at(some.next()).features;
    benchmark::DoNotOptimize(scene.snapshot.places->find(features.corner_descriptors(), {}));
  }
  state.counters["segments"] = static_cast<double>(scene.snapshot.places->num_segments());
}

void find_alike_keyframes(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  SomeKeyframes some(scene);
  for (auto _ : state) {
    benchmark::DoNotOptimize(find_alike(*scene.town.map, *scene.snapshot.places, some.next()));
  }
}

void find_beside_keyframe(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  constexpr SpatialNeighbourOptions kOptions = {
      .num_known_steps = 1, .distance = 0.6, .angle_rad = 0.5};
  SomeKeyframes some(scene);
  for (auto _ : state) {
    benchmark::DoNotOptimize(find_spatial_neighbours(*scene.town.map, some.next(), kOptions));
  }
}

void find_way(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  const LoopEdge& candidate = scene.town.revisits.back();
  for (auto _ : state) {
    benchmark::DoNotOptimize(shortest_way(*scene.town.map, candidate.from, candidate.to));
  }
}

void erase_one_keyframe(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  Map map = Map::thaw(*scene.town.map);
  SomeKeyframes some(scene);
  for (auto _ : state) {
    state.PauseTiming();
    KeyframeId id = some.next();
    while (!map.keyframes().contains(id) || !map.keyframes().at(id).parent.is_valid() ||
           map.has_loop_edge(id)) {
      id = some.next();
    }
    state.ResumeTiming();
    map.erase_keyframe(id);
  }
}

/// After the edit of one keyframe.
void freeze_map(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  Map map = Map::thaw(*scene.town.map);
  SomeKeyframes some(scene);
  for (auto _ : state) {
    map.set_motion(some.next(), {});
    benchmark::DoNotOptimize(map.freeze());
  }
}

/// The way of the map goes on: found again, tracked, mapped, places looked for.
void go_on(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  constexpr std::uint32_t kPerKeyframe = 4;
  constexpr std::uint32_t kNumFrames = 80;
  TownMapSettings settings = scene.settings;
  const auto first = static_cast<std::uint32_t>(settings.num_keyframes) * kPerKeyframe;
  settings.num_keyframes = first + kNumFrames;
  settings.step_m /= kPerKeyframe;
  const TownRecording recording = make_town_recording(scene.town.town, scene.town.rig, settings, 0);
  TownSession session(scene.town.rig, true);
  session.begin_in(scene.snapshot);
  std::uint32_t frame = 0;
  std::uint32_t num_tracked = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const TownFrame seen = recording.frame(first + frame++);
    state.ResumeTiming();
    num_tracked += session.track(seen).world_from_rig.has_value();
  }
  state.counters["tracked"] = num_tracked;
  state.counters["new_keyframes"] = static_cast<double>(session.map().keyframes().size()) -
                                    static_cast<double>(scene.settings.num_keyframes);
}

/// A candidate that is no loop edge yet, half a metre off.
LoopEdge drifted_loop(const TownScene& scene) {
  LoopEdge loop = scene.town.revisits.back();
  loop.to_from_from.translation.x() += 0.5;
  return loop;
}

void optimize_loop_of_town(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  const PeakCounter peak(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(optimize_loop(*scene.town.map, drifted_loop(scene)));
}

void apply_correction_to_all(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  const MapCorrection correction = small_correction(*scene.town.map);
  const PeakCounter peak(state);
  for (auto _ : state) {
    state.PauseTiming();
    std::optional<Map> map(Map::thaw(*scene.town.map));
    state.ResumeTiming();
    apply_correction(*map, correction);
    state.PauseTiming();
    map.reset();
    state.ResumeTiming();
  }
}

void fuse_all_overlaps(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  for (auto _ : state) {
    Map map = Map::thaw(*scene.town.map);
    ProjectionMatcher matcher;
    DirtyLandmarks dirty;
    fuse_overlaps(map, matcher, dirty);
  }
}

void adjust_all(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  const PeakCounter peak(state);
  for (auto _ : state) benchmark::DoNotOptimize(adjust_globally(*scene.town.map, SubmapId{0}));
}

void restore_map(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  for (auto _ : state) benchmark::DoNotOptimize(Map::restore(take_apart(*scene.town.map)));
}

void check_map(benchmark::State& state) {
  const TownScene& scene = closed_scene(state);
  for (auto _ : state) benchmark::DoNotOptimize(scene.town.map->broken_invariants());
}

/// The candidate that ends the way of a map whose loops are open, found by looks: all that the
/// mapper does before it takes the next keyframe.
void close_first_loop(benchmark::State& state) {
  const TownScene& scene = scene_of(static_cast<std::size_t>(state.range(0)), false);
  const PeakCounter peak(state);
  int num_loops = 0;
  for (auto _ : state) {
    state.PauseTiming();
    GlobalMapper mapper(scene.town.rig, {}, {}, {.refine = "off"}, 1);
    mapper.take_over(scene.snapshot);
    state.ResumeTiming();
    for (auto candidate = scene.town.revisits.rbegin();
         num_loops == 0 && candidate != scene.town.revisits.rend();
         ++candidate) {
      num_loops += mapper.close_alike(candidate->to);
    }
  }
  state.counters["loops"] = num_loops;
}

void register_all(std::int64_t num_keyframes) {
  const auto add = [&](const char* name, TownStep step, int num_iterations) {
    add_step(name, step, num_keyframes, num_iterations);
  };
  add("all/make_map", make_map, 1);
  add("one/make_frame", make_frame, 0);
  add("all/index_places", index_places, 1);
  add("one/find_place", find_place, 0);
  add("one/find_alike", find_alike_keyframes, 0);
  add("one/find_spatial_neighbours", find_beside_keyframe, 0);
  add("one/find_way", find_way, 0);
  add("one/erase_keyframe", erase_one_keyframe, 50);
  add("one/freeze", freeze_map, 0);
  add("one/go_on", go_on, 80);
  add("all/apply_correction", apply_correction_to_all, 1);
  add("all/restore", restore_map, 1);
  add("all/check", check_map, 1);
  register_saving_steps(num_keyframes);
  add("all/fuse_overlaps", fuse_all_overlaps, 1);
  add("all/optimize_loop", optimize_loop_of_town, 1);
  add("all/adjust", adjust_all, 1);
  add("all/close_loop", close_first_loop, 1);
  register_loop_steps(num_keyframes);
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  for (const std::int64_t size : {1'000, 3'000, 10'000, 30'000, 50'000, 100'000}) {
    waymark::register_all(size);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
