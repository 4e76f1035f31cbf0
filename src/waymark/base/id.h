// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>

namespace waymark {

/// A strongly typed index; ids of different tags never convert into each other.
template <class Tag>
struct Id {
  std::uint32_t value = UINT32_MAX;  ///< Index from 0 on; UINT32_MAX: no id.

  /// False for an id that was default-constructed: it means none.
  constexpr bool is_valid() const { return value != UINT32_MAX; }
  friend constexpr auto operator<=>(Id, Id) = default;
};

/// Counts frames from 0; those of keyframes go on where a map is extended.
using FrameId = Id<struct FrameTag>;
/// Of a Keyframe of a Map; never used again after it is erased.
using KeyframeId = Id<struct KeyframeTag>;
/// Of a Landmark of a Map; never used again after it is erased.
using LandmarkId = Id<struct LandmarkTag>;
using SubmapId = Id<struct SubmapTag>;  ///< Index in Map::submaps().

}  // namespace waymark
