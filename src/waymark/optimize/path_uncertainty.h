// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/optimize/pose_graph.h"

namespace waymark {

/// What the edges that are trusted say of how far the ends of the others may lie off: along the
/// ways of a spanning tree of them. Borrows the graph, whose nodes may move meanwhile.
class PathUncertainty {
 public:
  /// is_trusted: 1 or 0 per edge.
  PathUncertainty(const PoseGraph& graph, std::span<const std::uint8_t> is_trusted);

  /// Length that the residual of an edge may be expected to have, in standard deviations; infinite
  /// where no way leads from one end to the other.
  double expected_residual(const PoseGraphEdge& edge) const;

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  void spread_from(std::uint32_t root,
                   std::span<const std::vector<std::uint32_t>> edges_of_node,
                   std::vector<std::uint8_t>& is_reached);
  double squared_share(const PoseGraphEdge& step, const PoseGraphEdge& edge) const;

  const PoseGraph& graph_;
  std::vector<std::uint32_t> above_;  // Edge that leads towards the root, per node.
  std::vector<std::uint32_t> depth_;  // Per node.
};

}  // namespace waymark
