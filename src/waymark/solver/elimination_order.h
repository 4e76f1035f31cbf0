// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace waymark {

/// Rows and columns of blocks that are not zero, row > column, in any order; repeats allowed.
using BlockPattern = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// An order of elimination that leaves few blocks to fill in: nested dissection (George 1973), by
/// the distance from the rim of the graph (George & Liu 1978) and the least vertex cover of what is
/// cut (Pothen & Fan 1990; Ashcraft & Liu 1998), down to parts that approximate minimum degree
/// orders (Amestoy, Davis & Duff 1996). Children of the elimination tree come right before their
/// parent (Liu 1990), so that columns of the same structure follow each other. Per block its new
/// index.
std::vector<std::uint32_t> order_of_elimination(std::size_t num_blocks,
                                                const BlockPattern& pattern);

}  // namespace waymark
