// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>

namespace waymark {

/// A strongly typed index; ids of different tags never convert into each other.
template <class Tag>
struct Id {
  std::uint32_t value = UINT32_MAX;

  constexpr bool is_valid() const { return value != UINT32_MAX; }
  friend constexpr auto operator<=>(Id, Id) = default;
};

using FrameId = Id<struct FrameTag>;
using KeyframeId = Id<struct KeyframeTag>;
using LandmarkId = Id<struct LandmarkTag>;
using SubmapId = Id<struct SubmapTag>;

}  // namespace waymark
