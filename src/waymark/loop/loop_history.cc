// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/loop_history.h"

#include <algorithm>

#include "waymark/loop/odometry.h"
#include "waymark/loop/undo.h"

namespace waymark {
namespace {

/// A loop between keyframes so near to those of another says the same again.
constexpr std::uint32_t kSameLoop = 3;

}  // namespace

void LoopHistory::note_odometry(Mapper& mapper) {
  mapper.change([&](Map& map, DirtyLandmarks&) { waymark::note_odometry(map, end_of_odometry_); });
  end_of_odometry_ = mapper.map().keyframes().end_id();
}

LoopHistory::Verdict LoopHistory::weigh(const LoopEdge& loop, Mapper& mapper) {
  const Map& map = mapper.map();
  const SubmapId submap = map.keyframes().at(loop.to).submap;
  std::vector<LoopEdge> loops = map.measured_loop_edges();
  const std::size_t num_of_map = loops.size();
  loops.insert(loops.end(), rejected_.begin(), rejected_.end());
  // Nothing but the length of the way, which has been looked at, can contradict the first.
  if (loops.empty()) return {};
  loops.push_back(as_measured(map, loop));
  const std::vector<std::uint8_t> is_on = choose_loops(map, submap, loops, num_of_map);
  std::vector<LoopEdge> also;
  for (std::size_t i = num_of_map; i < loops.size(); ++i) {
    if (is_on[i]) also.push_back(loops[i]);
  }
  const auto of_map = std::span(is_on).first(num_of_map);
  const auto num_undone = static_cast<int>(std::ranges::count(of_map, std::uint8_t{0}));
  if (num_undone > 0) undo(submap, of_map, also, mapper);
  num_loops_ = std::max(num_loops_ - num_undone, 0);
  if (!is_on.back()) reject(loops.back());
  return {is_on.back() != 0, num_undone > 0};
}

/// is_on: 1 or 0 per loop edge of the map. also: further loops that are believed.
void LoopHistory::undo(SubmapId submap,
                       std::span<const std::uint8_t> is_on,
                       std::span<const LoopEdge> also,
                       Mapper& mapper) {
  for (std::size_t i = 0; i < is_on.size(); ++i) {
    if (!is_on[i]) reject(mapper.map().measured_loop_edges()[i]);
  }
  mapper.change(
      [&](Map& map, DirtyLandmarks& dirty) { undo_loops(map, submap, is_on, also, dirty); });
}

void LoopHistory::reject(const LoopEdge& loop) {
  const auto is_same = [](KeyframeId a, KeyframeId b) {
    return std::max(a.value, b.value) - std::min(a.value, b.value) <= kSameLoop;
  };
  const bool is_known = std::ranges::any_of(rejected_, [&](const LoopEdge& old) {
    return is_same(old.from, loop.from) && is_same(old.to, loop.to);
  });
  if (!is_known) rejected_.push_back(loop);
}

}  // namespace waymark
