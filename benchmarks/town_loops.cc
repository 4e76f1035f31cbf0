// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "town_loops.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "town_scene.h"
#include "waymark/base/rng.h"
#include "waymark/geometry/alignment.h"
#include "waymark/loop/drift.h"
#include "waymark/loop/find.h"
#include "waymark/loop/global_mapper.h"
#include "waymark/loop/odometry.h"
#include "waymark/simulate/testing/town_map.h"

namespace waymark {
namespace {

/// Loops of a map whose loops are open: places that it truly saw again, and places that are far
/// from each other, taken for one and the same.
struct MixedLoops {
  std::vector<LoopEdge> all;
  std::vector<LoopEdge> true_ones;
  std::vector<std::uint8_t> is_true;  ///< Per loop.
};

MixedLoops mix_loops(const TownMap& town, std::size_t num_true, std::size_t num_false) {
  constexpr double kSigmaM = 0.05, kSigmaRad = 0.002;         // Of true ones.
  constexpr double kSigmaFalseM = 1.0, kSigmaFalseRad = 0.1;  // Places look as from the same pose.
  constexpr double kNearM = 3.0, kNearRad = 0.5, kFarM = 10.0;
  MixedLoops loops;
  Rng rng(1, 0);
  const auto add = [&](KeyframeId from, KeyframeId to, const Rigid3& to_from_from, bool is_true) {
    Vector6d noise;
    const double sigma_m = is_true ? kSigmaM : kSigmaFalseM;
    const double sigma_rad = is_true ? kSigmaRad : kSigmaFalseRad;
    for (int i = 0; i < 6; ++i) noise[i] = (i < 3 ? sigma_m : sigma_rad) * rng.normal();
    loops.all.push_back({from, to, Sim3(Rigid3::exp(noise) * to_from_from)});
    loops.is_true.push_back(is_true);
    if (is_true) loops.true_ones.push_back(loops.all.back());
  };
  const auto count = static_cast<std::uint32_t>(town.world_from_rig.size());
  while (loops.all.size() < num_true + num_false) {
    const KeyframeId from{rng.below(count)}, to{rng.below(count)};
    if (from.value + 50 > to.value) continue;
    const Rigid3 to_from_from =
        town.world_from_rig[to.value].inverse() * town.world_from_rig[from.value];
    const double distance = to_from_from.translation.norm();
    const bool is_near = distance < kNearM && so3_log(to_from_from.rotation).norm() < kNearRad;
    if (is_near && loops.true_ones.size() < num_true) add(from, to, to_from_from, true);
    const std::size_t num_false_now = loops.all.size() - loops.true_ones.size();
    if (distance > kFarM && num_false_now < num_false) add(from, to, Rigid3(), false);
  }
  return loops;
}

/// Root mean square distance of the keyframes from the truth after the best rigid motion.
double error_after(const TownMap& town, const MapCorrection& correction) {
  std::vector<Eigen::Vector3d> mapped, truth;
  for (const MapCorrection::KeyframeMove& move : correction.keyframes) {
    mapped.push_back(move.rig_from_world.origin_in_source());
    truth.push_back(town.world_from_rig[move.keyframe.value].translation);
  }
  const Rigid3 truth_from_map = align_rigid(mapped, truth).value();
  double sum = 0.0;
  for (std::size_t i = 0; i < mapped.size(); ++i) {
    sum += (truth_from_map * mapped[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(mapped.size()));
}

TownMap drifting_town(benchmark::State& state) {
  return make_town_map({.num_keyframes = static_cast<std::size_t>(state.range(0)),
                        .is_closed = false,
                        .drift_of_way = 0.02,
                        .turn_of_step_rad = 5e-4});
}

MapCorrection as_mapped(const Map& map) {
  MapCorrection correction;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    correction.keyframes.push_back({id, keyframe.rig_from_world});
  });
  return correction;
}

/// The error of the map after closing loops one by one, and what was closed and not undone.
struct ClosedLoops {
  double ate_m = 0.0;
  std::size_t num_loops = 0;
};
ClosedLoops close_in_turn(const TownMap& town,
                          const MapSnapshot& snapshot,
                          std::vector<LoopEdge> loops) {
  std::ranges::stable_sort(loops, {}, &LoopEdge::to);
  GlobalMapper mapper(town.rig, {}, {}, {.refine = "off"}, 1);
  mapper.take_over(snapshot);
  for (const LoopEdge& loop : loops) {
    LoopCandidate candidate;
    candidate.query = loop.to;
    candidate.match = loop.from;
    candidate.query_from_match = loop.to_from_from;
    mapper.close(candidate);
  }
  return {error_after(town, as_mapped(mapper.map())), mapper.map().measured_loop_edges().size()};
}

bool is_plausible(const Map& map, const LoopEdge& loop) {
  LoopCandidate candidate;
  candidate.query = loop.to;
  candidate.match = loop.from;
  candidate.query_from_match = loop.to_from_from;
  return is_plausible_loop(map, candidate);
}

/// 200 false loops among 500 true ones, where odometry drifts ten times as much as in the other
/// towns: which are believed, and what the map is like with them.
void choose_among_loops(benchmark::State& state) {
  const TownMap town = drifting_town(state);
  Map map = Map::thaw(*town.map);
  note_odometry(map);
  constexpr std::size_t kNumTrue = 500, kNumFalse = 200;
  const MixedLoops loops = mix_loops(town, kNumTrue, kNumFalse);
  std::vector<std::uint8_t> is_on;
  for (auto _ : state) is_on = choose_loops(map, SubmapId{0}, loops.all, 0);
  std::vector<LoopEdge> chosen;
  double num_true = 0.0;
  double num_plausible[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < is_on.size(); ++i) {
    num_plausible[loops.is_true[i]] += is_plausible(map, loops.all[i]);
    if (!is_on[i]) continue;
    chosen.push_back(loops.all[i]);
    num_true += loops.is_true[i];
  }
  const auto error_with = [&](const std::vector<LoopEdge>& used) {
    return error_after(town, place_by_odometry(map, SubmapId{0}, used));
  };
  state.counters["true_on"] = num_true;
  state.counters["false_on"] = static_cast<double>(chosen.size()) - num_true;
  state.counters["true_plausible"] = num_plausible[1];
  state.counters["false_plausible"] = num_plausible[0];
  state.counters["ate_open_m"] = error_with({});
  state.counters["ate_true_m"] = error_with(loops.true_ones);
  state.counters["ate_chosen_m"] = error_with(chosen);
  state.counters["ate_all_m"] = error_with(loops.all);
}

/// 20 false loops among 50 true ones, in the order in which the camera comes by; without what looks
/// and plausibility would have kept out.
void close_mixed_loops(benchmark::State& state) {
  const TownMap town = drifting_town(state);
  const MapSnapshot snapshot = index_map(town.map);
  constexpr std::size_t kNumTrue = 50, kNumFalse = 20;
  const MixedLoops loops = mix_loops(town, kNumTrue, kNumFalse);
  ClosedLoops closed;
  for (auto _ : state) closed = close_in_turn(town, snapshot, loops.all);
  state.counters["closed"] = static_cast<double>(closed.num_loops);
  state.counters["ate_closed_m"] = closed.ate_m;
  state.counters["ate_closed_true_m"] = close_in_turn(town, snapshot, loops.true_ones).ate_m;
}

}  // namespace

void register_loop_steps(std::int64_t num_keyframes) {
  add_step("all/choose_loops", choose_among_loops, num_keyframes, 1);
  // Each loop is spread over all of the map.
  if (num_keyframes <= 1000) add_step("all/close_mixed", close_mixed_loops, num_keyframes, 1);
}

}  // namespace waymark
