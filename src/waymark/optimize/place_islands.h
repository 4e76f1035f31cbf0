// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "waymark/optimize/pose_graph.h"

namespace waymark {

/// Which ties of islands are believed.
struct IslandOptions {
  /// See SwitchOptions.
  double max_residual = 4.3;
  /// Ties whose ends lie nearer to each other than so many standard deviations of the translation,
  /// on both sides, are of one place: what looks like another place there does so for all of them.
  double same_place = 500.0;
  /// Ties that were believed before, by index.
  std::vector<std::size_t> believed = {};
};

/// What islands say of their ties, by index, ascending.
struct IslandTies {
  std::vector<std::size_t> believed;       ///< To begin with.
  std::vector<std::size_t> contradicting;  ///< Those between islands that do not agree.
};

/// Islands are parts of a graph that nothing but ties, the edges from first_tie on, hold to each
/// other, so that nothing but other ties can contradict a tie. Moves each island to where ties of
/// most places agree that it is, on equal terms to where those that were believed have it. What is
/// fixed stays, or else the first node. Ties that do not agree could still bend an island until
/// they do, as little contradicts that: they are not to be believed. All of one island: nothing
/// changes. Same input, same bits.
IslandTies place_islands(PoseGraph& graph, std::size_t first_tie, const IslandOptions& options);

}  // namespace waymark
