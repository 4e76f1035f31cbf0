// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "waymark/mapfile/map_file.h"

namespace waymark {

/// What became of two stored maps.
struct MergedStored {
  StoredMap stored;                  ///< Its settings and frame are those of the first.
  std::size_t num_parts_before = 0;  ///< Sub-maps of both that are parts of their own.
  std::size_t num_parts = 0;         ///< Those of the result.
  int num_joins = 0;                 ///< 0: no overlap was found.
  int num_loops = 0;                 ///< Further places of one that the other shows.
  /// One is in metres and the scale of the other is free, so that nothing was compared.
  bool is_incomparable = false;
};

/// Merges the maps, see merge_maps(), and puts the images of both into one table.
MergedStored merge_stored(const StoredMap& a, const StoredMap& b, std::uint64_t seed);

}  // namespace waymark
