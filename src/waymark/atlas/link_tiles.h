// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "waymark/atlas/atlas.h"
#include "waymark/map/map.h"

namespace waymark {

/// What two tiles both show, if keyframes of b are recognised in a: by the rules by which map merge
/// joins maps (see GlobalMapper), of which the landmarks that are the same are taken, and no more.
/// queries: keyframes of b that may show a, the likeliest first. Pure: the same tiles, queries and
/// seed give the same. Nothing where no place is found, or one is in metres and the other is not.
std::optional<SharedLandmarks> match_tiles(const Map& a,
                                           const Map& b,
                                           std::span<const KeyframeId> queries,
                                           std::uint64_t seed);

/// The similarity b_from_a of two tiles by the landmarks that they share (Umeyama 1991), a rigid
/// motion where they are in metres, by least median of squares (Rousseeuw 1984) and then by all
/// that are not off three times as far as the middling one; each counts by how finely it was seen.
/// Nothing where that is not determined.
std::optional<Sim3> fit_tiles(const Map& a, const Map& b, const SharedLandmarks& shared);

}  // namespace waymark
