// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/camera/camera.h"
#include "waymark/image/features.h"

namespace waymark {

// What map files may hold. Readers refuse more before they allocate it.

inline constexpr std::size_t kMaxArrayBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxRecordBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 20;
inline constexpr std::uint32_t kMaxIds = std::uint32_t{1} << 28;  ///< Ids are below.
inline constexpr std::size_t kMaxCamerasPerRig = 16;
inline constexpr std::size_t kMaxSubmaps = std::size_t{1} << 20;
inline constexpr std::size_t kLandmarksPerRecord = 4096;

// Arrays are written and read as they lie in memory.
static_assert(std::endian::native == std::endian::little);

/// How the elements of an array lie in a map file: the type of a number as NumPy calls it, and how
/// many there are in an element, of one or two dimensions.
struct MapArrayLayout {
  std::string_view dtype;
  std::size_t number_bytes = 0;
  std::vector<std::size_t> element_shape;
};

/// Of numbers, ids, vectors and matrices of fixed size, and descriptors.
template <class T>
MapArrayLayout map_array_layout() {
  if constexpr (requires { typename T::Scalar; }) {
    // Eigen keeps columns together: the transposed matrix in the order of C.
    MapArrayLayout layout = map_array_layout<typename T::Scalar>();
    if (T::ColsAtCompileTime > 1) layout.element_shape.push_back(T::ColsAtCompileTime);
    layout.element_shape.push_back(T::RowsAtCompileTime);
    return layout;
  } else if constexpr (std::is_same_v<T, Descriptor>) {
    return {"|u1", 1, {32}};  // Bit i of the descriptor is bit i % 8 of byte i / 8.
  } else if constexpr (std::is_floating_point_v<T>) {
    return {sizeof(T) == 4 ? "<f4" : "<f8", sizeof(T), {}};
  } else if constexpr (std::is_same_v<T, std::uint8_t>) {
    return {"|u1", 1, {}};
  } else {
    static_assert(std::is_same_v<T, std::uint32_t> || requires(T id) { id.is_valid(); });
    return {"<u4", 4, {}};
  }
}

static_assert(sizeof(Descriptor) == 32 && sizeof(Matrix23f) == 24 && sizeof(LandmarkId) == 4);

}  // namespace waymark
