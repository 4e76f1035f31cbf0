// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Matching of two simulated views half a metre apart in a room, about 1000 features each: by
// projection of landmarks, by appearance in a window and alone, along epipolar curves; and the
// distance of descriptors below all of them.
#include <benchmark/benchmark.h>

#include <numeric>
#include <vector>

#include "waymark/image/hamming.h"
#include "waymark/match/epipolar.h"
#include "waymark/match/projection.h"
#include "waymark/match/test_scene.h"

namespace waymark {
namespace {

struct Views {
  std::shared_ptr<const Rig> rig = make_test_rig(1);
  Rigid3 world_from_a = make_test_pose({0.0, 0.0, 0.0}, {0.0, 0.0, 0.0});
  Rigid3 world_from_b = make_test_pose({0.5, 0.05, 0.1}, {0.01, -0.06, 0.02});
  PointCloud cloud = scatter_in({-4.0, -3.0, 3.0}, {4.0, 3.0, 9.0}, 2500, 5.0, 1);
  PointObservation a = observe(cloud, *rig, world_from_a, {.outlier_share = 0.2}, 0);
  PointObservation b = observe(cloud, *rig, world_from_b, {.outlier_share = 0.2}, 1);
};

const Views& views() {
  static const Views made;
  return made;
}

/// Times match(), which gives the number of matches.
template <class Match>
void measure(benchmark::State& state, const Match& match) {
  std::size_t num_matches = 0;
  for (auto _ : state) num_matches = match();
  state.counters["features"] = static_cast<double>(views().b.features->num_primary);
  state.counters["matches"] = static_cast<double>(num_matches);
}

/// Argument: search radius in pixels.
void match_by_projection(benchmark::State& state) {
  const LandmarkSet landmarks = true_landmarks(views().cloud, views().world_from_a.translation);
  ProjectionMatcher matcher(views().rig);
  const Rigid3 rig_from_world = views().world_from_b.inverse();
  measure(state, [&] {
    return matcher
        .match(landmarks,
               *views().b.features,
               {},
               rig_from_world,
               {.radius_px = static_cast<double>(state.range(0))})
        .num_matches;
  });
}
BENCHMARK(match_by_projection)->Arg(5)->Arg(15)->Arg(40)->Unit(benchmark::kMicrosecond);

void match_by_appearance(benchmark::State& state) {
  std::vector<std::uint32_t> indices(views().a.features->num_primary);
  std::iota(indices.begin(), indices.end(), 0u);
  AppearanceMatcher matcher;
  measure(state, [&] {
    return matcher.match_all(*views().a.features, indices, *views().b.features, AppearanceOptions{})
        .size();
  });
}
BENCHMARK(match_by_appearance)->Unit(benchmark::kMicrosecond);

/// Argument: search radius in pixels.
void match_in_window(benchmark::State& state) {
  std::vector<Eigen::Vector2f> pixels;
  for (const Keypoint& keypoint : views().a.features->keypoints) {
    pixels.emplace_back(keypoint.x_px, keypoint.y_px);
  }
  pixels.resize(views().a.features->num_primary);
  AppearanceMatcher matcher;
  measure(state, [&] {
    return matcher
        .match_near(*views().a.features,
                    pixels,
                    static_cast<double>(state.range(0)),
                    *views().b.features,
                    AppearanceOptions{})
        .size();
  });
}
BENCHMARK(match_in_window)->Arg(60)->Unit(benchmark::kMicrosecond);

void match_along_epipolar_curves(benchmark::State& state) {
  const std::vector<std::uint8_t> none_a(views().a.features->num_primary);
  const std::vector<std::uint8_t> none_b(views().b.features->num_primary);
  const Rigid3 b_from_a = views().world_from_b.inverse() * views().world_from_a;
  EpipolarMatcher matcher;
  measure(state, [&] {
    return matcher.match(*views().a.features, none_a, *views().b.features, none_b, b_from_a, {})
        .size();
  });
}
BENCHMARK(match_along_epipolar_curves)->Unit(benchmark::kMicrosecond);

/// One descriptor against all of a view.
void compare_descriptors(benchmark::State& state) {
  const FeatureArray<Descriptor>& all = views().b.features->descriptors;
  const Descriptor query = views().a.features->descriptors.front();
  std::vector<std::uint16_t> out(all.size());
  for (auto _ : state) {
    distances(query, all, out);
    benchmark::DoNotOptimize(out.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(all.size()));
}
BENCHMARK(compare_descriptors);

}  // namespace
}  // namespace waymark
