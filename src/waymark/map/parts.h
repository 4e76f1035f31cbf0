// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/map/map.h"

namespace waymark {

/// Puts all of a map behind what the parts hold: its sub-maps, keyframes and landmarks get ids that
/// follow those there, and its frames indices. Rigs that are the same become one; nothing else ties
/// the two together.
void append_parts(const Map& map, MapParts& parts);

/// A map in plain lists.
MapParts take_apart(const Map& map);

/// Two maps in one, side by side. What belongs to b has the ids it had plus the ends of the ids of
/// a: keyframe k of b is k + a.keyframes().end_id().
Map unite(const Map& a, const Map& b);

}  // namespace waymark
