// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "waymark/mapping/bundle_window.h"

namespace waymark {

/// Halves keyframes by where they are, along the axis in which they extend furthest, until no part
/// has more than max_size of them. share: of the keyframes before a cut, by which two divisions
/// have their borders elsewhere. Parts are ascending by id and not empty.
std::vector<std::vector<KeyframeId>> divide_by_place(const Map& map,
                                                     std::vector<KeyframeId> keyframes,
                                                     std::size_t max_size,
                                                     double share);

/// Adjusts a window of any size in parts of up to max_size keyframes, one after the other, each
/// held by all around it that sees the same; then once more with the borders elsewhere. Time is
/// linear in what the window has, and the memory is that of one part. What bends over the length of
/// many parts stays bent: that is for the pose graph. Outliers come by part.
WindowAdjustment compute_adjustment_in_parts(const Map& map,
                                             const BundleWindow& window,
                                             const BundleOptions& options,
                                             std::size_t max_size);

}  // namespace waymark
