// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "waymark/image/features.h"
#include "waymark/place/place_segment.h"

namespace waymark {

/// How much of a query each row of the segments shows, 0 to 1, one value per row in order.
///
/// Each descriptor looks in each table at some 32 descriptors of all segments that share the
/// longest prefixes with its key, as in the synchronous descent of Bawa, Condie and Ganesan (2005):
/// which they are does not depend on how the rows are distributed over segments. Those whose keys
/// differ little from its own are votes for their rows, one per descriptor and row. A vote weighs
/// more the fewer rows share it, as in the inverse document frequency of text retrieval (Sparck
/// Jones 1972); 1 means that every descriptor voted for this row alone.
std::vector<double> vote_for_places(std::span<const std::shared_ptr<const PlaceSegment>> segments,
                                    std::span<const Descriptor> descriptors);

}  // namespace waymark
