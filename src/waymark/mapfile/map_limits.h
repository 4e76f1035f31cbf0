// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace waymark {

// What map files may hold. Readers refuse more before they allocate it.

inline constexpr std::size_t kMaxArrayBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxRecordBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 20;
inline constexpr std::uint32_t kMaxIds = std::uint32_t{1} << 28;  ///< Ids are below.
inline constexpr std::size_t kMaxCamerasPerRig = 16;
inline constexpr std::size_t kMaxSubmaps = std::size_t{1} << 20;
inline constexpr std::size_t kLandmarksPerRecord = 4096;

}  // namespace waymark
