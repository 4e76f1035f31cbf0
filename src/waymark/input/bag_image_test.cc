// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_image.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "waymark/bag/testing/message_writer.h"
#include "waymark/base/testing/errors.h"

namespace waymark {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::little;
using testing::write_message;

const BagTopic kRaw{"/a", "sensor_msgs/Image", RosEncoding::kCdr, 1};
const BagTopic kCompressed{"/a/compressed", "sensor_msgs/CompressedImage", RosEncoding::kRos1, 1};

/// A message of an image whose rows have two bytes more than needed.
std::string raw(const std::string& encoding, const cv::Mat& pixels, bool is_bigendian = false) {
  const std::size_t row_bytes = pixels.elemSize() * static_cast<std::size_t>(pixels.cols);
  std::string data;
  for (int y = 0; y < pixels.rows; ++y) {
    data += std::string(reinterpret_cast<const char*>(pixels.ptr(y)), row_bytes) + "##";
  }
  return write_message(RosEncoding::kCdr,
                       1,
                       RosImage{"f",
                                static_cast<std::uint32_t>(pixels.rows),
                                static_cast<std::uint32_t>(pixels.cols),
                                encoding,
                                is_bigendian,
                                static_cast<std::uint32_t>(row_bytes + 2),
                                data});
}

std::string packed(const std::string& format, const std::string& data) {
  return write_message(RosEncoding::kRos1, 1, RosCompressedImage{"f", format, data});
}

std::string encode(const char* extension, const cv::Mat& pixels) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, pixels, bytes);
  return {bytes.begin(), bytes.end()};
}

/// An even grey-green of 8x6 px.
const cv::Vec3b kBgr(40, 120, 90);
cv::Mat even() { return {6, 8, CV_8UC3, cv::Scalar(kBgr[0], kBgr[1], kBgr[2])}; }
constexpr std::uint8_t kLuma = 102;  // 0.114 * 40 + 0.587 * 120 + 0.299 * 90.

TEST(BagImage, OfEachColourBecomesItsLuma) {
  cv::Mat rgb;
  cv::Mat bgra;
  cv::Mat rgba;
  cv::cvtColor(even(), rgb, cv::COLOR_BGR2RGB);
  cv::cvtColor(even(), bgra, cv::COLOR_BGR2BGRA);
  cv::cvtColor(even(), rgba, cv::COLOR_BGR2RGBA);
  EXPECT_THAT(read_bag_image(raw("bgr8", even()), kRaw, "x").values, Each(kLuma));
  EXPECT_THAT(read_bag_image(raw("rgb8", rgb), kRaw, "x").values, Each(kLuma));
  EXPECT_THAT(read_bag_image(raw("bgra8", bgra), kRaw, "x").values, Each(kLuma));
  EXPECT_THAT(read_bag_image(raw("rgba8", rgba), kRaw, "x").values, Each(kLuma));
}

TEST(BagImage, OfEachBayerPatternBecomesItsLuma) {
  // The colour of each of the first two pixels of two rows, as the name says; B, G, R are 0, 1, 2.
  const std::pair<const char*, std::array<int, 4>> patterns[] = {{"bayer_rggb8", {2, 1, 1, 0}},
                                                                 {"bayer_bggr8", {0, 1, 1, 2}},
                                                                 {"bayer_gbrg8", {1, 0, 2, 1}},
                                                                 {"bayer_grbg8", {1, 2, 0, 1}}};
  for (const auto& [name, colours] : patterns) {
    cv::Mat mosaic(16, 16, CV_8UC1);
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        const int colour = colours[static_cast<std::size_t>(y % 2 * 2 + x % 2)];
        mosaic.at<std::uint8_t>(y, x) = kBgr[colour];
      }
    }
    // 93 where red and blue change places.
    const Image image = read_bag_image(raw(name, mosaic), kRaw, "x");
    for (int i = 0; i < 4; ++i)
      EXPECT_NEAR(image.view().at(7 + i / 2, 7 + i % 2), kLuma, 1) << name;
  }
}

TEST(BagImage, OfFourTwoTwoIsItsBrightness) {
  const cv::Mat uyvy(2, 4, CV_8UC2, cv::Scalar(128, 77));
  const cv::Mat yuyv(2, 4, CV_8UC2, cv::Scalar(77, 128));
  EXPECT_THAT(read_bag_image(raw("yuv422", uyvy), kRaw, "x").values, Each(77));
  EXPECT_THAT(read_bag_image(raw("yuv422_yuy2", yuyv), kRaw, "x").values, Each(77));
}

TEST(BagImage, OfSixteenBitsIsScaledInEitherOrderOfBytes) {
  const cv::Mat little_endian(2, 2, CV_16UC1, cv::Scalar(0x8000));
  const cv::Mat big_endian(2, 2, CV_16UC1, cv::Scalar(0x0080));
  EXPECT_THAT(read_bag_image(raw("mono16", little_endian), kRaw, "x").values, Each(128));
  EXPECT_THAT(read_bag_image(raw("mono16", big_endian, true), kRaw, "x").values, Each(128));
}

TEST(BagImage, CompressedIsDecoded) {
  const cv::Mat grey(6, 8, CV_8UC1, cv::Scalar(55));
  EXPECT_THAT(read_bag_image(packed("png", encode(".png", grey)), kCompressed, "x").values,
              Each(55));
  const std::string jpeg = encode(".jpg", grey);
  EXPECT_THAT(read_bag_image(packed("jpeg", jpeg), kCompressed, "x").values, Each(55));
  EXPECT_EQ(read_bag_jpeg(packed("jpeg", jpeg), kCompressed, "x"), jpeg) << "as it is";
  EXPECT_TRUE(read_bag_jpeg(raw("bgr8", even()), kRaw, "x").starts_with("\xFF\xD8\xFF"));
}

TEST(BagDepth, OfSixteenBitsStaysAndOfMetresIsCounted) {
  const cv::Mat millimetres(2, 2, CV_16UC1, cv::Scalar(1234));
  const cv::Mat metres(2, 2, CV_32FC1, cv::Scalar(1.25F));
  EXPECT_THAT(read_bag_depth(raw("16UC1", millimetres), kRaw, 5000, "x").values, Each(1234));
  EXPECT_THAT(read_bag_depth(raw("32FC1", metres), kRaw, 1000, "x").values, Each(1250));
}

TEST(BagDepth, CompressedIsAsItsTransportQuantisesIt) {
  const cv::Mat stored(2, 2, CV_16UC1, cv::Scalar(30));
  const std::string header = little(std::uint32_t{0}) +
                             little(std::bit_cast<std::uint32_t>(50.0F)) +
                             little(std::bit_cast<std::uint32_t>(5.0F));
  const std::string data = header + encode(".png", stored);
  EXPECT_THAT(
      read_bag_depth(packed("16UC1; compressedDepth png", data), kCompressed, 1, "x").values,
      Each(30));
  // 50 / (30 - 5) = 2 m.
  EXPECT_THAT(read_bag_depth(packed("32FC1; compressedDepth", data), kCompressed, 1000, "x").values,
              Each(2000));
}

TEST(BagImageHeader, TellsDepthFromBrightness) {
  const BagTopic depth{"/depth/image", "sensor_msgs/Image", RosEncoding::kCdr, 1};
  const cv::Mat metres(2, 2, CV_32FC1, cv::Scalar(1));
  const cv::Mat bits16(2, 2, CV_16UC1, cv::Scalar(1));
  EXPECT_TRUE(read_bag_image_header(raw("32FC1", metres), kRaw, "x").is_depth);
  EXPECT_TRUE(read_bag_image_header(raw("16UC1", bits16), depth, "x").is_depth);
  EXPECT_FALSE(read_bag_image_header(raw("16UC1", bits16), kRaw, "x").is_depth);
  EXPECT_TRUE(
      read_bag_image_header(packed("16UC1; compressedDepth", ""), kCompressed, "x").is_depth);
}

TEST(BagImage, SaysWhatIsWrong) {
  const auto error = [](const std::string& bytes, const BagTopic& topic) {
    return input_error_of([&] { read_bag_image(bytes, topic, "x.bag: /a"); });
  };
  EXPECT_THAT(error(raw("32SC1", cv::Mat(2, 2, CV_32SC1)), kRaw),
              HasSubstr("x.bag: /a: an image of encoding '32SC1', expected one of mono8"));
  EXPECT_THAT(error("junk", kRaw), HasSubstr("a damaged message, expected sensor_msgs/Image"));
  EXPECT_THAT(error(packed("jpeg", "junk"), kCompressed),
              HasSubstr("format 'jpeg' that cannot be"));
  const auto stated = [](std::uint32_t height, std::uint32_t width, std::uint32_t step) {
    return write_message(
        RosEncoding::kCdr, 1, RosImage{"f", height, width, "mono8", false, step, "12345678"});
  };
  EXPECT_THAT(error(stated(3, 4, 4), kRaw), HasSubstr("4x3 px in rows of 4 bytes and 8 bytes"));
  EXPECT_THAT(error(stated(2, 4, 3), kRaw), HasSubstr("expected them to fit"));
  EXPECT_THAT(error(stated(0, 4, 4), kRaw), HasSubstr("expected them to fit"));
  EXPECT_THAT(error(stated(2, 0xFFFFFFFF, 0xFFFFFFFF), kRaw), HasSubstr("expected them to fit"));
  EXPECT_EQ(error(stated(2, 4, 4), kRaw), "no error");
}

}  // namespace
}  // namespace waymark
