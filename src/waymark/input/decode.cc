// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/decode.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/image/image_header.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/plain_png.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

constexpr std::string_view kJpegStart = "\xFF\xD8\xFF";
constexpr int kGreyOfAnyDepth =
    cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION;
constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 30;

std::optional<std::string> read_bytes(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size == 0 || size > kMaxFileBytes) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(size))) return std::nullopt;
  return bytes;
}

/// Whether the end of the file is there. The library fills the missing part of a truncated JPEG
/// with grey and reports success.
bool is_complete_jpeg(std::string_view bytes) {
  constexpr std::string_view kJpegEnd = "\xFF\xD9";
  return bytes.rfind(kJpegEnd) != std::string_view::npos;
}

/// The bytes to decode: sound as far as can be seen, and without what the library would only
/// complain about on standard error. Nothing if they are of no image to be read.
std::optional<std::string_view> vet(std::string_view bytes, std::optional<std::string>& storage) {
  const std::optional<ImageSize> size = size_in_header(bytes);
  if (!size || is_too_large(*size)) return std::nullopt;
  if (bytes.starts_with(kJpegStart) && !is_complete_jpeg(bytes)) return std::nullopt;
  if (!is_png(bytes)) return bytes;
  storage = pixels_of_png(bytes);
  return storage ? std::optional<std::string_view>(*storage) : std::nullopt;
}

std::optional<cv::Mat> decode_bytes(std::string_view bytes, int flags) {
  if (bytes.empty() || bytes.size() > kMaxFileBytes) return std::nullopt;
  try {
    std::optional<std::string> storage;
    const std::optional<std::string_view> vetted = vet(bytes, storage);
    if (!vetted) return std::nullopt;
    // Of what is asked for unchanged only 16 bits of grey are taken: depth.
    if (storage && (flags == kGreyOfAnyDepth || flags == cv::IMREAD_UNCHANGED)) {
      if (std::optional<cv::Mat> decoded = decode_plain_png(*vetted)) return decoded;
    }
    const cv::Mat encoded(1,
                          static_cast<int>(vetted->size()),
                          CV_8UC1,
                          const_cast<char*>(vetted->data()));  // Is only read.
    cv::Mat decoded = cv::imdecode(encoded, flags);
    if (decoded.empty()) return std::nullopt;
    return decoded;
  } catch (const cv::Exception&) {
    return std::nullopt;
  } catch (const std::bad_alloc&) {
    return std::nullopt;
  }
}

std::string encode(const cv::Mat& image, const char* extension) {
  if (std::max(image.cols, image.rows) > kMaxSidePx) {
    throw InputError(
        "image",
        fmt::format(
            "is {}x{} px, expected at most {} px a side", image.cols, image.rows, kMaxSidePx));
  }
  std::vector<std::uint8_t> bytes;
  WAYMARK_CHECK(cv::imencode(extension, image, bytes));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::optional<Image> read_grey_image(const std::filesystem::path& path, const Levels& levels) {
  const std::optional<std::string> bytes = read_bytes(path);
  return bytes ? decode_grey_image(*bytes, levels) : std::nullopt;
}

std::optional<Image> decode_grey_image(std::string_view bytes, const Levels& levels) {
  std::optional<cv::Mat> mat = decode_bytes(bytes, kGreyOfAnyDepth);
  if (!mat) return std::nullopt;
  if (mat->type() == CV_16UC1) *mat = in_8_bits(*mat, levels);
  if (mat->type() != CV_8UC1) return std::nullopt;
  return image_of<std::uint8_t>(*mat);
}

std::optional<BasicImage<std::uint16_t>> read_grey16_image(const std::filesystem::path& path) {
  const std::optional<std::string> bytes = read_bytes(path);
  return bytes ? decode_grey16_image(*bytes) : std::nullopt;
}

std::optional<BasicImage<std::uint16_t>> decode_grey16_image(std::string_view bytes) {
  const std::optional<cv::Mat> mat = decode_bytes(bytes, kGreyOfAnyDepth);
  if (!mat || mat->type() != CV_16UC1) return std::nullopt;
  return image_of<std::uint16_t>(*mat);
}

std::optional<DepthImage> read_depth_image(const std::filesystem::path& path) {
  const std::optional<std::string> bytes = read_bytes(path);
  return bytes ? decode_depth_image(*bytes) : std::nullopt;
}

std::optional<DepthImage> decode_depth_image(std::string_view bytes) {
  const std::optional<cv::Mat> mat = decode_bytes(bytes, cv::IMREAD_UNCHANGED);
  if (!mat || mat->type() != CV_16UC1) return std::nullopt;
  return image_of<std::uint16_t>(*mat);
}

std::string describe_bad_image(const std::filesystem::path& path, std::string_view expected) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return fmt::format("missing, expected {}", expected);
  if (!std::filesystem::is_regular_file(status)) {
    return fmt::format("is no regular file, expected {}", expected);
  }
  const std::optional<std::string> bytes = read_bytes(path);
  if (!bytes) return fmt::format("unreadable, empty or above 1 GB, expected {}", expected);
  const std::optional<ImageSize> size = size_in_header(*bytes);
  if (!size) return fmt::format("unreadable as an image, expected {}", expected);
  if (!is_too_large(*size)) {
    return fmt::format("unreadable, damaged or of another kind, expected {}", expected);
  }
  return fmt::format("is {}x{} px, expected at most {} megapixels and {} px a side",
                     size->width_px,
                     size->height_px,
                     kMaxMegapixels,
                     kMaxSidePx);
}

std::optional<ColorImage> decode_color_image(std::string_view bytes) {
  const std::optional<cv::Mat> mat =
      decode_bytes(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (!mat || mat->type() != CV_8UC3) return std::nullopt;
  ColorImage image(mat->cols, mat->rows);
  for (int y = 0; y < mat->rows; ++y) {
    for (int x = 0; x < mat->cols; ++x) {
      const cv::Vec3b& bgr = mat->at<cv::Vec3b>(y, x);
      image.row(y)[x] = {bgr[2], bgr[1], bgr[0]};
    }
  }
  return image;
}

std::optional<std::string> read_as_jpeg(const std::filesystem::path& path, const Levels& levels) {
  const std::optional<std::string> bytes = read_bytes(path);
  return bytes ? as_jpeg(*bytes, levels) : std::nullopt;
}

std::optional<std::string> as_jpeg(std::string_view bytes, const Levels& levels) {
  std::optional<std::string> unused;
  if (bytes.starts_with(kJpegStart) && vet(bytes, unused)) return std::string(bytes);
  const int depth = levels == Levels{} ? 0 : cv::IMREAD_ANYDEPTH;
  const std::optional<cv::Mat> mat =
      decode_bytes(bytes, cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION | depth);
  if (!mat) return std::nullopt;
  return encode(mat->depth() == CV_16U ? in_8_bits(*mat, levels) : *mat, ".jpg");
}

std::string encode_jpeg(const ColorImage& image) {
  cv::Mat mat(image.height_px, image.width_px, CV_8UC3);
  for (int y = 0; y < mat.rows; ++y) {
    for (int x = 0; x < mat.cols; ++x) {
      const Rgb& rgb = image.row(y)[x];
      mat.at<cv::Vec3b>(y, x) = {rgb[2], rgb[1], rgb[0]};
    }
  }
  return encode(mat, ".jpg");
}

std::string encode_png(const Image& image) { return encode(mat_of(image.view()), ".png"); }

void silence_image_library() {
  static const bool is_done = [] {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    constexpr const char* kQuiet = "-8";  // AV_LOG_QUIET
    return ::setenv("OPENCV_FFMPEG_LOGLEVEL", kQuiet, /*overwrite=*/0) == 0;
  }();
  static_cast<void>(is_done);
}

}  // namespace waymark
