// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "waymark/map/map.h"

namespace waymark {

/// Two maps in one.
struct MergedMaps {
  std::shared_ptr<const Map> map;
  int num_joins = 0;  ///< Sub-maps that became part of another; 0: no overlap was found.
  int num_loops = 0;  ///< Further places of one map that the other shows.
};

/// Puts b behind a (see unite()), and where keyframes of b show places of a, joins their sub-maps
/// and closes the loops that this makes, joins those that know the same markers, then links and
/// adjusts all of it. Frame and units are those of the older sub-map, of which a has all. Sub-maps
/// in metres are not compared with those whose scale is free. The same maps and seed give the same
/// bits.
MergedMaps merge_maps(const Map& a, const Map& b, std::uint64_t seed);

}  // namespace waymark
