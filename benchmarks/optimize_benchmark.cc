// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <cmath>

#include "waymark/optimize/bundle.h"
#include "waymark/optimize/pose.h"
#include "waymark/optimize/schur_solver.h"
#include "waymark/optimize/test_ceres.h"
#include "waymark/optimize/test_scene.h"

namespace waymark {
namespace {

/// Arguments: observations, outliers in percent, prediction error in mrad.
void optimize_pose_of_frame(benchmark::State& state) {
  const auto scene =
      testing::make_pose_scene({.num_observations = static_cast<std::size_t>(state.range(0)),
                                .noise_px = 0.8,
                                .share_of_outliers = static_cast<double>(state.range(1)) / 100.0},
                               1);
  Rng rng(1, 2);
  const double error = 1e-3 * static_cast<double>(state.range(2));
  const Rigid3 initial =
      Rigid3::exp(testing::random_tangent(rng, error, error)) * scene.rig_from_world;
  PoseWorkspace workspace;
  int num_iterations = 0;
  for (auto _ : state) {
    const auto estimate = optimize_pose(scene.rig, scene.observations, initial, {}, workspace);
    benchmark::DoNotOptimize(estimate.num_inliers);
    num_iterations = estimate.num_iterations;
  }
  state.counters["iterations"] = num_iterations;
}
BENCHMARK(optimize_pose_of_frame)
    ->Args({1000, 0, 1})
    ->Args({1000, 20, 5})
    ->Args({1000, 50, 20})
    ->Args({300, 20, 5})
    ->Unit(benchmark::kMicrosecond);

/// One round of five iterations. Arguments: solver (0 own, 1 Ceres), and what the scene takes.
void adjust(benchmark::State& state, const testing::BundleScene& scene, unsigned num_threads = 1) {
  const auto minimize = state.range(0) == 0 ? minimize_with_schur : testing::minimize_with_ceres;
  const BundleOptions options = {
      .max_iterations_per_round = 5, .relative_cost_tolerance = 0.0, .num_threads = num_threads};
  const std::vector<std::uint8_t> is_used(scene.problem.observations.size(), 1);
  BundleRound result;
  for (auto _ : state) {
    state.PauseTiming();
    BundleProblem problem = scene.problem;
    problem.rigs.assign(problem.rig_from_world.size(), &scene.rig);
    state.ResumeTiming();
    result = minimize(problem, is_used, options);
    benchmark::DoNotOptimize(problem.points.data());
  }
  state.counters["observations"] = static_cast<double>(scene.problem.observations.size());
  state.counters["cost"] = result.final_cost;
  state.counters["iterations"] = result.num_iterations;
}

/// A local window: 12 free and 20 fixed poses, 2500 points, 10000 observations. Second argument:
/// cameras.
void adjust_local_bundle(benchmark::State& state) {
  adjust(state,
         testing::make_bundle_scene({.num_poses = 32,
                                     .num_fixed = 20,
                                     .num_points = 2500,
                                     .num_cameras = static_cast<std::size_t>(state.range(1)),
                                     .share_of_outliers = 0.03},
                                    1));
}
BENCHMARK(adjust_local_bundle)
    ->Args({0, 1})
    ->Args({1, 1})
    ->Args({0, 2})
    ->Args({1, 2})
    ->Unit(benchmark::kMillisecond);

/// Many free poses: the reduced system dominates. Second argument: poses.
void adjust_global_bundle(benchmark::State& state) {
  const auto num_poses = static_cast<std::size_t>(state.range(1));
  adjust(state,
         testing::make_bundle_scene(
             {.num_poses = num_poses, .num_points = 60 * num_poses, .views_per_point = 5}, 1));
}
BENCHMARK(adjust_global_bundle)
    ->Args({0, 50})
    ->Args({1, 50})
    ->Args({0, 200})
    ->Args({1, 200})
    ->Unit(benchmark::kMillisecond);

/// A way in rows beside each other, as long as there are rows: 100 points per pose, six views of
/// each in two rows; two threads. Second argument: poses. 10000 have a million points.
void adjust_area_bundle(benchmark::State& state) {
  const auto num_poses = static_cast<std::size_t>(state.range(1));
  adjust(state,
         testing::make_bundle_scene(
             {.num_poses = num_poses,
              .num_points = 100 * num_poses,
              .views_per_point = 6,
              .poses_per_row = static_cast<std::size_t>(std::sqrt(static_cast<double>(num_poses)))},
             1),
         2);
}
BENCHMARK(adjust_area_bundle)
    ->Args({0, 1024})
    ->Args({1, 1024})
    ->Args({0, 10000})
    ->Args({1, 10000})
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace waymark
