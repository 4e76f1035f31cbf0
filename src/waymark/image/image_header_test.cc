// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/image_header.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "waymark/base/crc32.h"

namespace waymark {
namespace {

std::string encode_as(const char* extension, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes));
  return {bytes.begin(), bytes.end()};
}

cv::Mat noise(int width_px, int height_px) {
  cv::Mat image(height_px, width_px, CV_8UC3);
  cv::theRNG().state = 1;
  cv::randu(image, 0, 255);
  return image;
}

/// A PNG chunk with its length and checksum.
std::string chunk(const std::string& kind, const std::string& content) {
  std::string bytes(4, '\0');
  bytes[3] = static_cast<char>(content.size());
  bytes += kind + content;
  const std::uint32_t checksum = crc32(kind + content);
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(checksum >> shift);
  return bytes;
}

TEST(SizeInHeader, IsThatOfTheImage) {
  for (const char* extension : {".png", ".jpg", ".tif", ".bmp", ".webp", ".ppm"}) {
    const std::string bytes = encode_as(extension, noise(333, 77));
    EXPECT_EQ(size_in_header(bytes), (ImageSize{333, 77})) << extension;
    for (std::size_t size = 0; size < 60; ++size) size_in_header(bytes.substr(0, size));
  }
  EXPECT_EQ(size_in_header("P5 # of a # camera\n60000 # wide\n 50000\n255\n"),
            (ImageSize{60000, 50000}));
  const std::string large = "P5 " + std::string(40, '9') + " 1\n";
  for (const std::string& bytes : {std::string(),
                                   std::string("P5"),
                                   std::string("P5 3"),
                                   large,
                                   std::string("no image"),
                                   std::string("\xFF\xD8\xFF\xE0")}) {
    EXPECT_EQ(size_in_header(bytes), std::nullopt) << bytes;
  }
}

TEST(PixelsOfPng, AreWithoutWhatIsNotNeeded) {
  const std::string whole = encode_as(".png", noise(40, 30));
  EXPECT_EQ(pixels_of_png(whole), whole);
  std::string more = whole;
  more.insert(33, chunk("iCCP", "no profile"));  // Behind the header.
  EXPECT_EQ(pixels_of_png(more), whole);
}

TEST(PixelsOfPng, AreRefusedWhereDamaged) {
  const std::string whole = encode_as(".png", noise(40, 30));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ASSERT_EQ(pixels_of_png(whole.substr(0, size)), std::nullopt) << size;
  }
  for (const std::size_t at : {12, 25, 26, 40, 200, 1000}) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 4);
    EXPECT_EQ(pixels_of_png(flipped), std::nullopt) << at;
  }
}

}  // namespace
}  // namespace waymark
