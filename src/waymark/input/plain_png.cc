// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/plain_png.h"

#include <libdeflate.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "waymark/image/image_header.h"

namespace waymark {
namespace {

constexpr std::size_t kSignatureSize = 8;
constexpr std::size_t kChunkOverhead = 12;
constexpr std::size_t kDepthAt = 24;
constexpr std::size_t kColorAt = 25;
constexpr std::size_t kInterlaceAt = 28;
constexpr int kGrey = 0;
constexpr int kRgb = 2;

std::size_t whole_at(std::string_view bytes, std::size_t at) {
  std::size_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<std::uint8_t>(bytes[at + i]);
  return value;
}

/// The compressed values, which may be divided into several chunks.
std::string compressed_in(std::string_view bytes) {
  std::string compressed;
  for (std::size_t at = kSignatureSize; at + kChunkOverhead <= bytes.size();) {
    const std::size_t length = whole_at(bytes, at);
    if (bytes.substr(at + 4, 4) == "IDAT") compressed += bytes.substr(at + 8, length);
    at += kChunkOverhead + length;
  }
  return compressed;
}

bool inflate(std::string_view compressed, std::vector<std::uint8_t>& values) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>
      decompressor(libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  return decompressor && libdeflate_zlib_decompress(decompressor.get(),
                                                    compressed.data(),
                                                    compressed.size(),
                                                    values.data(),
                                                    values.size(),
                                                    nullptr) == LIBDEFLATE_SUCCESS;
}

/// Paeth's predictor (ISO/IEC 15948, 9.4).
int nearest_to_plane(int left, int above, int above_left) {
  const int by_left = std::abs(above - above_left);
  const int by_above = std::abs(left - above_left);
  const int by_corner = std::abs(left + above - 2 * above_left);
  // Without branches, which noise would make the processor guess wrong.
  const int is_left = -static_cast<int>((by_left <= by_above) & (by_left <= by_corner));
  const int is_above = -static_cast<int>(by_above <= by_corner);
  return (left & is_left) | (((above & is_above) | (above_left & ~is_above)) & ~is_left);
}

/// Adds to a row what its filter predicted (ISO/IEC 15948, 9.2) of pixels of kStep bytes. Whether
/// there is such a filter.
template <int kStep>
bool unfilter(int filter, const std::uint8_t* above, std::uint8_t* row, int size) {
  const auto add = [&](auto&& predict) {
    int left[kStep] = {};
    int corner[kStep] = {};
    for (int i = 0; i < size; i += kStep) {
      for (int k = 0; k < kStep; ++k) {
        const int up = above[i + k];
        left[k] = (row[i + k] + predict(left[k], up, corner[k])) & 0xFF;
        corner[k] = up;
        row[i + k] = static_cast<std::uint8_t>(left[k]);
      }
    }
  };
  switch (filter) {
    case 0:
      return true;
    case 1:
      add([](int left, int, int) { return left; });
      return true;
    case 2:
      for (int i = 0; i < size; ++i) row[i] = static_cast<std::uint8_t>(row[i] + above[i]);
      return true;
    case 3:
      add([](int left, int up, int) { return (left + up) / 2; });
      return true;
    case 4:
      add(nearest_to_plane);
      return true;
    default:
      return false;
  }
}

/// Of all rows, each of which begins with its filter.
template <int kStep>
bool unfilter_all(std::vector<std::uint8_t>& values, int height_px, int row_size) {
  const std::vector<std::uint8_t> zeros(static_cast<std::size_t>(row_size));
  const std::uint8_t* above = zeros.data();
  for (int y = 0; y < height_px; ++y) {
    std::uint8_t* const row = values.data() + static_cast<std::size_t>(y) * (row_size + 1) + 1;
    if (!unfilter<kStep>(row[-1], above, row, row_size)) return false;
    above = row;
  }
  return true;
}

/// As libpng weighs red, green and blue, asked for 0.299 and 0.587.
std::uint8_t grey_of(const std::uint8_t* rgb) {
  return static_cast<std::uint8_t>((9797 * rgb[0] + 19234 * rgb[1] + 3737 * rgb[2]) >> 15);
}

/// Of rows that still have their filters in front.
cv::Mat grey_rows(const std::vector<std::uint8_t>& values, const ImageSize& size, int step) {
  cv::Mat grey(size.height_px, size.width_px, step == 2 ? CV_16UC1 : CV_8UC1);
  const std::size_t stride = static_cast<std::size_t>(step) * size.width_px + 1;
  for (int y = 0; y < size.height_px; ++y) {
    const std::uint8_t* const row = values.data() + static_cast<std::size_t>(y) * stride + 1;
    if (step == 1) {
      std::copy_n(row, size.width_px, grey.ptr<std::uint8_t>(y));
    } else if (step == 2) {
      auto* const to = grey.ptr<std::uint16_t>(y);
      for (int x = 0; x < size.width_px; ++x) {
        to[x] = static_cast<std::uint16_t>(row[2 * x] << 8 | row[2 * x + 1]);
      }
    } else {
      auto* const to = grey.ptr<std::uint8_t>(y);
      for (int x = 0; x < size.width_px; ++x) to[x] = grey_of(row + 3 * x);
    }
  }
  return grey;
}

}  // namespace

std::optional<cv::Mat> decode_plain_png(std::string_view bytes) {
  const std::optional<ImageSize> size = size_in_header(bytes);
  if (!size || bytes.size() <= kInterlaceAt || bytes[kInterlaceAt] != 0) return std::nullopt;
  const int depth = bytes[kDepthAt];
  const int color = bytes[kColorAt];
  const bool is_plain =
      (color == kGrey && (depth == 8 || depth == 16)) || (color == kRgb && depth == 8);
  if (!is_plain) return std::nullopt;
  const int step = color == kRgb ? 3 : depth / 8;
  const int row_size = step * size->width_px;
  std::vector<std::uint8_t> values(static_cast<std::size_t>(size->height_px) * (row_size + 1));
  if (!inflate(compressed_in(bytes), values)) return std::nullopt;
  const auto unfilter_rows = step == 1   ? unfilter_all<1>
                             : step == 2 ? unfilter_all<2>
                                         : unfilter_all<3>;
  if (!unfilter_rows(values, size->height_px, row_size)) return std::nullopt;
  return grey_rows(values, *size, step);
}

}  // namespace waymark
