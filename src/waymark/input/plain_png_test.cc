// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/plain_png.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

#include <cstdlib>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "waymark/base/crc32.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

constexpr int kWidth = 37, kHeight = 23;

std::string big_endian(std::size_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xFF);
  return bytes;
}

std::string chunk(const std::string& kind, const std::string& content) {
  return big_endian(content.size()) + kind + content + big_endian(crc32(kind + content));
}

std::string deflate(const std::string& values) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(6), &libdeflate_free_compressor);
  std::string compressed(values.size() + 1000, '\0');
  compressed.resize(libdeflate_zlib_compress(
      compressor.get(), values.data(), values.size(), compressed.data(), compressed.size()));
  return compressed;
}

struct Kind {
  int color;
  int depth;
  int step() const { return color == 2 ? 3 : depth / 8; }
};

/// By which the filters 0 to 4 make less of a byte (ISO/IEC 15948, 9.2).
int predicted(int filter, int left, int up, int corner) {
  if (filter == 4) {
    const int plane = left + up - corner;
    const int off_left = std::abs(plane - left), off_up = std::abs(plane - up);
    if (off_left <= off_up && off_left <= std::abs(plane - corner)) return left;
    return off_up <= std::abs(plane - corner) ? up : corner;
  }
  return filter == 0 ? 0 : filter == 1 ? left : filter == 2 ? up : (left + up) / 2;
}

/// A PNG file of any values, each row with the next filter, in two chunks.
std::string png_of(const Kind& kind, int interlace = 0) {
  Rng rng(5, 0);
  const int row_size = kind.step() * kWidth;
  std::string values, filtered;
  const auto value_at = [&](int y, int x) {
    return y < 0 || x < 0 ? 0 : static_cast<unsigned char>(values[y * row_size + x]);
  };
  for (int y = 0; y < kHeight; ++y) {
    const int filter = y % 5;
    filtered += static_cast<char>(filter);
    for (int x = 0; x < row_size; ++x) {
      const int value = (10 * y + x + static_cast<int>(rng.uniform(0.0, 60.0))) & 0xFF;
      values += static_cast<char>(value);
      const int step = kind.step();
      filtered += static_cast<char>(value - predicted(filter,
                                                      value_at(y, x - step),
                                                      value_at(y - 1, x),
                                                      x < step ? 0 : value_at(y - 1, x - step)));
    }
  }
  std::string header = big_endian(kWidth) + big_endian(kHeight);
  for (const int byte : {kind.depth, kind.color, 0, 0, interlace})
    header += static_cast<char>(byte);
  const std::string compressed = deflate(filtered);
  const std::size_t half = compressed.size() / 2;
  return "\x89PNG\r\n\x1A\n" + chunk("IHDR", header) + chunk("IDAT", compressed.substr(0, half)) +
         chunk("IDAT", compressed.substr(half)) + chunk("IEND", "");
}

class PlainPng : public ::testing::TestWithParam<Kind> {};

TEST_P(PlainPng, HasTheValuesOfTheImageLibrary) {
  std::string bytes = png_of(GetParam());
  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1, bytes.data());
  const cv::Mat expected = cv::imdecode(encoded, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  ASSERT_EQ(expected.size(), cv::Size(kWidth, kHeight));
  const std::optional<cv::Mat> decoded = decode_plain_png(bytes);
  ASSERT_TRUE(decoded);
  ASSERT_EQ(decoded->type(), expected.type());
  EXPECT_EQ(cv::norm(*decoded, expected, cv::NORM_INF), 0.0);
}

TEST_P(PlainPng, LeavesWhatIsDamagedToTheImageLibrary) {
  const std::string bytes = png_of(GetParam());
  EXPECT_FALSE(decode_plain_png(bytes.substr(0, bytes.size() / 2)));
  EXPECT_FALSE(decode_plain_png(bytes.substr(0, 20)));
  EXPECT_FALSE(decode_plain_png({}));
  EXPECT_FALSE(decode_plain_png(png_of(GetParam(), 1)));
  std::string taller = bytes;
  taller[23] = kHeight + 1;
  EXPECT_FALSE(decode_plain_png(taller));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, PlainPng, ::testing::Values(Kind{0, 8}, Kind{0, 16}, Kind{2, 8}), [](const auto& info) {
      return (info.param.color == 0 ? "Grey" : "Colour") + std::to_string(info.param.depth);
    });

TEST(PlainPngOfOtherKinds, IsLeftToTheImageLibrary) {
  EXPECT_FALSE(decode_plain_png(png_of({2, 16})));
  EXPECT_FALSE(decode_plain_png(png_of({3, 8})));
  EXPECT_FALSE(decode_plain_png(png_of({6, 8})));
}

}  // namespace
}  // namespace waymark
