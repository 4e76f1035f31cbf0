// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "town_scene.h"

#include <malloc.h>

#include <memory>

namespace waymark {

const TownScene& scene_of(std::size_t num_keyframes, bool is_closed) {
  static std::unique_ptr<TownScene> scene;
  if (scene && scene->settings.num_keyframes == num_keyframes &&
      scene->settings.is_closed == is_closed) {
    return *scene;
  }
  scene = std::make_unique<TownScene>();
  scene->settings = {.num_keyframes = num_keyframes, .is_closed = is_closed};
  scene->town = make_town_map(scene->settings);
  scene->snapshot = index_map(scene->town.map);
  malloc_trim(0);
  return *scene;
}

const TownScene& closed_scene(const benchmark::State& state) {
  return scene_of(static_cast<std::size_t>(state.range(0)), true);
}

MapCorrection small_correction(const Map& map) {
  MapCorrection correction;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    correction.keyframes.push_back({id, keyframe.rig_from_world});
  });
  return correction;
}

void add_step(const char* name, TownStep step, std::int64_t num_keyframes, int num_iterations) {
  auto* registered = benchmark::RegisterBenchmark(name, step);
  registered->Arg(num_keyframes)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
  if (num_iterations > 0) registered->Iterations(num_iterations);
}

}  // namespace waymark
