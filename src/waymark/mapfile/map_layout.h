// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/camera/camera.h"
#include "waymark/features/features.h"

namespace waymark {

// What map files may hold. Readers refuse more before they allocate it.

inline constexpr std::size_t kMaxArrayBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxRecordBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 20;
/// Ids are below. Most ids of a long session are of landmarks that are gone: it is a day or more
/// until there are so many, and a table whose largest id is the last one takes 64 MB by that.
inline constexpr std::uint32_t kMaxIds = std::uint32_t{1} << 28;
inline constexpr std::size_t kMaxCamerasPerRig = 16;
inline constexpr std::size_t kMaxSubmaps = std::size_t{1} << 20;
inline constexpr std::size_t kLandmarksPerRecord = 4096;
inline constexpr std::size_t kKeyframesPerRecord = 4096;
inline constexpr std::uint32_t kMaxMarkerNumber = 1u << 20;
inline constexpr std::size_t kMaxMarkersPerKeyframe = 4096;

/// What a number may be; NaN never is within.
struct NumberRange {
  double low = std::numeric_limits<double>::lowest();
  double high = std::numeric_limits<double>::max();

  /// Whether a number may be so.
  constexpr bool contains(double number) const { return number >= low && number <= high; }
};

// What the numbers of a map may be: the writer asks for it as the reader does, so that no map is
// written that cannot be read.
inline constexpr NumberRange kNotNegative{0.0};
inline constexpr NumberRange kPositive{std::numeric_limits<double>::min()};
inline constexpr NumberRange kScaleRange{1e-12, 1e12};
inline constexpr NumberRange kLengthRange{-1e15, 1e15};
inline constexpr NumberRange kMarkerSideRange{1e-6, 1e6};
inline constexpr NumberRange kDepthRange{kPositive.low, kLengthRange.high};
inline constexpr NumberRange kLandmarkSizeRange{0.0, kLengthRange.high};
inline constexpr NumberRange kDirectionRange{-2.0, 2.0};
inline constexpr NumberRange kAngleRange{-10.0, 10.0};  ///< In radians.
inline constexpr NumberRange kFeatureSizeRange{kPositive.low, kAngleRange.high};
inline constexpr NumberRange kSlopeRange{-1e9, 1e9};  ///< In pixels per unit of bearing.
inline constexpr double kMaxNormError = 1e-6;         ///< Of quaternions.

/// A number that is not what it may be, and its place.
struct OutsideNumber {
  std::size_t index = 0;
  double number = 0.0;
};

/// The first number of an array's elements that is outside of the range; nothing if none is, or
/// they hold no floating-point numbers.
template <class Array>
std::optional<OutsideNumber> find_outside(const Array& values, const NumberRange& range) {
  using T = typename Array::value_type;
  if constexpr (std::is_floating_point_v<T>) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto number = static_cast<double>(values[i]);
      if (!range.contains(number)) return OutsideNumber{i, number};
    }
  } else if constexpr (requires { typename T::Scalar; }) {
    constexpr std::size_t kPerElement = sizeof(T) / sizeof(typename T::Scalar);
    for (std::size_t i = 0; i < kPerElement * values.size(); ++i) {
      const auto number = static_cast<double>(values[i / kPerElement].data()[i % kPerElement]);
      if (!range.contains(number)) return OutsideNumber{i, number};
    }
  }
  return std::nullopt;
}

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
