// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "waymark/bag/byte_source.h"
#include "waymark/bag/ros_messages.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/image/convert.h"
#include "waymark/image/image_header.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/decode.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

/// How the pixels of an encoding (sensor_msgs/image_encodings.h) become grey or colour: codes of
/// cv::cvtColor. ROS names a Bayer pattern by its first two pixels, OpenCV by those one further
/// along the diagonal.
struct PixelEncoding {
  std::string_view name;
  int type;
  int to_grey;
  int to_bgr;
};

constexpr int kAsItIs = -1;
/// OpenCV's direct way from a Bayer pattern gives every other pixel of an even image 5 % too much.
constexpr int kViaColour = -2;

constexpr std::array kPixelEncodings = {
    PixelEncoding{"mono8", CV_8UC1, kAsItIs, kAsItIs},
    PixelEncoding{"8UC1", CV_8UC1, kAsItIs, kAsItIs},
    PixelEncoding{"mono16", CV_16UC1, kAsItIs, kAsItIs},
    PixelEncoding{"16UC1", CV_16UC1, kAsItIs, kAsItIs},
    PixelEncoding{"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY, kAsItIs},
    PixelEncoding{"8UC3", CV_8UC3, cv::COLOR_BGR2GRAY, kAsItIs},
    PixelEncoding{"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY, cv::COLOR_RGB2BGR},
    PixelEncoding{"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    PixelEncoding{"8UC4", CV_8UC4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    PixelEncoding{"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY, cv::COLOR_RGBA2BGR},
    PixelEncoding{"bayer_rggb8", CV_8UC1, kViaColour, cv::COLOR_BayerBG2BGR},
    PixelEncoding{"bayer_bggr8", CV_8UC1, kViaColour, cv::COLOR_BayerRG2BGR},
    PixelEncoding{"bayer_gbrg8", CV_8UC1, kViaColour, cv::COLOR_BayerGR2BGR},
    PixelEncoding{"bayer_grbg8", CV_8UC1, kViaColour, cv::COLOR_BayerGB2BGR},
    PixelEncoding{"bayer_rggb16", CV_16UC1, kViaColour, cv::COLOR_BayerBG2BGR},
    PixelEncoding{"bayer_bggr16", CV_16UC1, kViaColour, cv::COLOR_BayerRG2BGR},
    PixelEncoding{"bayer_gbrg16", CV_16UC1, kViaColour, cv::COLOR_BayerGR2BGR},
    PixelEncoding{"bayer_grbg16", CV_16UC1, kViaColour, cv::COLOR_BayerGB2BGR},
    PixelEncoding{"yuv422", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    PixelEncoding{"uyvy", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    PixelEncoding{"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2, cv::COLOR_YUV2BGR_YUY2},
    PixelEncoding{"yuyv", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2, cv::COLOR_YUV2BGR_YUY2},
};

const PixelEncoding& encoding_of(const RosImage& image, const std::string& where) {
  const auto* const found =
      std::ranges::find(kPixelEncodings, image.encoding, &PixelEncoding::name);
  if (found != kPixelEncodings.end()) return *found;
  std::string known;
  for (const PixelEncoding& encoding : kPixelEncodings)
    known += fmt::format("{}{}", known.empty() ? "" : ", ", encoding.name);
  throw InputError(
      where,
      fmt::format(
          "an image of encoding {}, expected one of {}", quote_for_message(image.encoding), known));
}

bool is_compressed(const BagTopic& topic) { return topic.type != "sensor_msgs/Image"; }

[[noreturn]] void fail_message(const BagTopic& topic, const std::string& where) {
  throw InputError(
      where,
      fmt::format("a damaged message, expected {} of {}",
                  topic.type,
                  topic.encoding == RosEncoding::kCdr ? "little-endian CDR" : "ROS 1"));
}

RosImage parse_image(std::string_view bytes, const BagTopic& topic, const std::string& where) {
  std::optional<RosImage> image = parse_ros_image(bytes, topic.encoding);
  if (!image) fail_message(topic, where);
  return *std::move(image);
}

RosCompressedImage parse_compressed(std::string_view bytes,
                                    const BagTopic& topic,
                                    const std::string& where) {
  std::optional<RosCompressedImage> image =
      parse_ros_compressed_image(bytes, topic.encoding, topic.type);
  if (!image) fail_message(topic, where);
  return *std::move(image);
}

/// The rows of an image in the message, checked to be there. Of more than 8 bits a copy, aligned
/// and in this machine's order of bytes.
cv::Mat rows_of(const RosImage& image, int type, const std::string& where) {
  const std::uint64_t row_bytes = std::uint64_t{image.width_px} * CV_ELEM_SIZE(type);
  const auto limit = static_cast<std::uint32_t>(kMaxMegapixels) * 1'000'000U;
  const bool is_sound =
      image.width_px > 0 && image.height_px > 0 && image.width_px <= limit &&
      image.height_px <= limit && image.step >= row_bytes &&
      std::uint64_t{image.step} * (image.height_px - 1) + row_bytes <= image.data.size();
  const ImageSize size{static_cast<int>(image.width_px), static_cast<int>(image.height_px)};
  if (!is_sound || is_too_large(size)) {
    throw InputError(where,
                     fmt::format("an image of {}x{} px in rows of {} bytes and {} bytes in all, "
                                 "expected them to fit",
                                 image.width_px,
                                 image.height_px,
                                 image.step,
                                 image.data.size()));
  }
  if (CV_MAT_DEPTH(type) == CV_8U) {
    return {size.height_px,
            size.width_px,
            type,
            const_cast<char*>(image.data.data()),  // Is only read.
            image.step};
  }
  cv::Mat copy(size.height_px, size.width_px, type);
  for (int y = 0; y < copy.rows; ++y) {
    const char* row = image.data.data() + static_cast<std::size_t>(y) * image.step;
    std::memcpy(copy.ptr(y), row, static_cast<std::size_t>(row_bytes));
  }
  const std::size_t value_bytes = CV_ELEM_SIZE1(type);
  for (uchar* value = copy.data; image.is_bigendian && value < copy.dataend; value += value_bytes) {
    std::reverse(value, value + value_bytes);
  }
  return copy;
}

/// Of 16 bits as levels have it.
cv::Mat convert(const cv::Mat& pixels, int code, const Levels& levels, const std::string& where) {
  try {
    cv::Mat converted = pixels;
    if (code != kAsItIs) cv::cvtColor(pixels, converted, code);
    return converted.depth() == CV_16U ? in_8_bits(converted, levels) : converted;
  } catch (const cv::Exception&) {
    throw InputError(where, "an image that cannot be converted, expected one of even size");
  }
}

[[noreturn]] void fail_compressed(const RosCompressedImage& image,
                                  std::string_view expected,
                                  const std::string& where) {
  throw InputError(where,
                   fmt::format("an image of format {} that cannot be decoded, expected {}",
                               quote_for_message(image.format),
                               expected));
}

/// Depth as compressed_depth_image_transport writes it: 12 bytes, which say how inverse depth was
/// quantised, and a PNG file.
DepthImage decode_compressed_depth(const RosCompressedImage& image,
                                   double units_per_m,
                                   const std::string& where) {
  constexpr std::string_view kExpected = "a PNG of 16 bits, as compressedDepth has it";
  const bool has_header = image.format.find("compressedDepth") != std::string::npos;
  FieldReader reader(image.data);
  if (has_header) reader.take(4);  // The kind of quantisation, of which there is one.
  const float quantum_a = has_header ? std::bit_cast<float>(reader.number<std::uint32_t>()) : 0.0F;
  const float quantum_b = has_header ? std::bit_cast<float>(reader.number<std::uint32_t>()) : 0.0F;
  std::optional<DepthImage> stored = decode_depth_image(reader.rest());
  if (!stored) fail_compressed(image, kExpected, where);
  if (!image.format.starts_with("32FC1")) return *std::move(stored);
  BasicImage<float> depth_m(stored->width_px, stored->height_px);
  for (std::size_t i = 0; i < depth_m.values.size(); ++i) {
    const float value = stored->values[i];
    depth_m.values[i] = value == 0.0F ? 0.0F : quantum_a / (value - quantum_b);
  }
  return depth_in_units(depth_m.view(), {.factor = units_per_m});
}

}  // namespace

std::string video_codec_of(std::string_view format) {
  struct Name {
    std::string_view part;
    std::string_view codec;
  };
  constexpr std::array kNames = {Name{"264", "h264"},
                                 Name{"avc", "h264"},
                                 Name{"265", "hevc"},
                                 Name{"hevc", "hevc"},
                                 Name{"vp9", "vp9"},
                                 Name{"vp8", "vp8"},
                                 Name{"av1", "av1"}};
  std::string lower(format);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const Name& name : kNames) {
    if (lower.find(name.part) != std::string::npos) return std::string(name.codec);
  }
  return {};
}

BagImageHeader read_bag_image_header(std::string_view bytes,
                                     const BagTopic& topic,
                                     const std::string& where) {
  // "Depth_0" in recordings of RealSense.
  const bool is_named_depth = topic.name.find("depth") != std::string::npos ||
                              topic.name.find("/Depth_") != std::string::npos;
  if (is_compressed(topic)) {
    const RosCompressedImage image = parse_compressed(bytes, topic, where);
    const bool is_depth = image.format.find("compressedDepth") != std::string::npos ||
                          (is_named_depth && image.format.starts_with("16UC1"));
    return {image.frame_id, image.format, is_depth};
  }
  const RosImage image = parse_image(bytes, topic, where);
  const bool is_depth =
      image.encoding == "32FC1" ||
      (is_named_depth && (image.encoding == "16UC1" || image.encoding == "mono16"));
  return {image.frame_id, image.encoding, is_depth};
}

Image read_bag_image(std::string_view bytes,
                     const BagTopic& topic,
                     const std::string& where,
                     const Levels& levels) {
  if (is_compressed(topic)) {
    const RosCompressedImage image = parse_compressed(bytes, topic, where);
    std::optional<Image> decoded = decode_grey_image(image.data, levels);
    if (!decoded) fail_compressed(image, "jpeg or png", where);
    return *std::move(decoded);
  }
  const RosImage image = parse_image(bytes, topic, where);
  const PixelEncoding& encoding = encoding_of(image, where);
  const cv::Mat rows = rows_of(image, encoding.type, where);
  if (encoding.to_grey != kViaColour) {
    return image_of<std::uint8_t>(convert(rows, encoding.to_grey, levels, where));
  }
  const cv::Mat colour = convert(rows, encoding.to_bgr, levels, where);
  return image_of<std::uint8_t>(convert(colour, cv::COLOR_BGR2GRAY, levels, where));
}

std::optional<BasicImage<std::uint16_t>> read_bag_grey16(std::string_view bytes,
                                                         const BagTopic& topic,
                                                         const std::string& where) {
  if (is_compressed(topic)) {
    return decode_grey16_image(parse_compressed(bytes, topic, where).data);
  }
  const RosImage image = parse_image(bytes, topic, where);
  const PixelEncoding& encoding = encoding_of(image, where);
  if (CV_MAT_DEPTH(encoding.type) != CV_16U) return std::nullopt;
  return image_of<std::uint16_t>(rows_of(image, encoding.type, where));
}

DepthImage read_bag_depth(std::string_view bytes,
                          const BagTopic& topic,
                          double units_per_m,
                          const std::string& where) {
  if (is_compressed(topic)) {
    return decode_compressed_depth(parse_compressed(bytes, topic, where), units_per_m, where);
  }
  const RosImage image = parse_image(bytes, topic, where);
  if (image.encoding == "16UC1" || image.encoding == "mono16") {
    return image_of<std::uint16_t>(rows_of(image, CV_16UC1, where));
  }
  if (image.encoding != "32FC1") {
    throw InputError(where,
                     fmt::format("an image of encoding {}, expected depth: 16UC1 or 32FC1",
                                 quote_for_message(image.encoding)));
  }
  const BasicImage<float> depth_m = image_of<float>(rows_of(image, CV_32FC1, where));
  return depth_in_units(depth_m.view(), {.factor = units_per_m});
}

std::string read_bag_jpeg(std::string_view bytes,
                          const BagTopic& topic,
                          const std::string& where,
                          const Levels& levels) {
  if (is_compressed(topic)) {
    const RosCompressedImage image = parse_compressed(bytes, topic, where);
    std::optional<std::string> jpeg = as_jpeg(image.data, levels);
    if (!jpeg) fail_compressed(image, "jpeg or png", where);
    return *std::move(jpeg);
  }
  const RosImage image = parse_image(bytes, topic, where);
  const PixelEncoding& encoding = encoding_of(image, where);
  const cv::Mat rows = rows_of(image, encoding.type, where);
  return jpeg_of(convert(rows, encoding.to_bgr, levels, where));
}

}  // namespace waymark
