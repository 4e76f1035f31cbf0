// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
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

template <class T>
MapArrayLayout map_array_layout();

template <>
inline MapArrayLayout map_array_layout<std::uint8_t>() {
  return {"|u1", 1, {}};
}
template <>
inline MapArrayLayout map_array_layout<std::uint32_t>() {
  return {"<u4", 4, {}};
}
template <>
inline MapArrayLayout map_array_layout<float>() {
  return {"<f4", 4, {}};
}
template <>
inline MapArrayLayout map_array_layout<double>() {
  return {"<f8", 8, {}};
}
template <>
inline MapArrayLayout map_array_layout<Eigen::Vector2f>() {
  return {"<f4", 4, {2}};
}
template <>
inline MapArrayLayout map_array_layout<Eigen::Vector3f>() {
  return {"<f4", 4, {3}};
}
template <>
inline MapArrayLayout map_array_layout<Eigen::Vector3d>() {
  return {"<f8", 8, {3}};
}
/// Eigen keeps columns together: the transposed matrix in the order of C.
template <>
inline MapArrayLayout map_array_layout<Matrix23f>() {
  return {"<f4", 4, {3, 2}};
}
/// Bit i of the descriptor is bit i % 8 of byte i / 8.
template <>
inline MapArrayLayout map_array_layout<Descriptor>() {
  return {"|u1", 1, {32}};
}
template <>
inline MapArrayLayout map_array_layout<KeyframeId>() {
  return map_array_layout<std::uint32_t>();
}
template <>
inline MapArrayLayout map_array_layout<LandmarkId>() {
  return map_array_layout<std::uint32_t>();
}
template <>
inline MapArrayLayout map_array_layout<SubmapId>() {
  return map_array_layout<std::uint32_t>();
}

static_assert(sizeof(Descriptor) == 32 && sizeof(Matrix23f) == 24 && sizeof(LandmarkId) == 4);

}  // namespace waymark
