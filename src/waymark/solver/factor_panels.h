// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/solver/elimination_order.h"

namespace waymark {

/// The columns of a Cholesky factor in panels: consecutive columns that share their rows below
/// (supernodes; Ng & Peyton 1993), up to few zeros that are kept as if they were none, wide ones
/// divided. Everything in blocks.
struct FactorPanels {
  struct Panel {
    std::uint32_t begin = 0;  ///< Columns.
    std::uint32_t end = 0;
    std::size_t first_row = 0;  ///< In `rows`: first its columns, then what is below.
    std::size_t num_rows = 0;
    std::uint32_t width() const { return end - begin; }
  };
  /// A panel before another of which some rows, [first, last) in its own count, are columns of the
  /// other.
  struct Source {
    std::uint32_t panel = 0;
    std::uint32_t first = 0;
    std::uint32_t last = 0;
  };

  std::vector<Panel> panels;  ///< Ascending.
  std::vector<std::uint32_t> rows;
  std::vector<std::uint32_t> panel_of_column;
  std::vector<Source> sources;            ///< By panel that they act on, then ascending.
  std::vector<std::size_t> first_source;  ///< Per panel, and one past the end.
  /// Panels, each after all of its sources, those that depend on nothing of each other together.
  std::vector<std::uint32_t> schedule;
  std::size_t num_blocks = 0;  ///< Of the factor, without the zeros that panels keep.

  std::span<const std::uint32_t> rows_of(const Panel& panel) const {
    return std::span(rows).subspan(panel.first_row, panel.num_rows);
  }
  std::span<const Source> sources_of(std::size_t panel) const {
    return std::span(sources).subspan(first_source[panel],
                                      first_source[panel + 1] - first_source[panel]);
  }
};

FactorPanels plan_panels(std::size_t num_columns, const BlockPattern& pattern);

}  // namespace waymark
