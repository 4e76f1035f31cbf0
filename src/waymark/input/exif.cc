// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/exif.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>

namespace waymark {
namespace {

constexpr std::string_view kExifStart{"Exif\0\0", 6};
/// The segment is the first of the file or the second, and has at most 64 KiB.
constexpr std::size_t kMaxBytes = std::size_t{1} << 18;
constexpr double kFilmDiagonalMm = 43.267;  // 36 x 24 mm
constexpr double kMaxAspectError = 0.01;
/// Likely focal lengths, in widths of the image.
constexpr double kShortest = 0.2, kLongest = 20.0;

enum Tag : std::uint64_t {
  kExifDirectory = 0x8769,
  kFocalLengthMm = 0x920A,
  kPixelWidth = 0xA002,
  kPixelHeight = 0xA003,
  kSensorPixelsPerUnit = 0xA20E,
  kSensorUnit = 0xA210,
  kFocalLengthOfFilmMm = 0xA405,
};

/// Directories of numbers as in TIFF 6.0, section 2. What is beyond the end reads as 0.
class TiffReader {
 public:
  explicit TiffReader(std::string_view bytes) : bytes_(bytes), is_big_(bytes.substr(0, 1) == "M") {}

  std::uint64_t whole(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || bytes_.size() - at < count) return 0;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      value = value << 8 | static_cast<unsigned char>(bytes_[at + (is_big_ ? i : count - 1 - i)]);
    }
    return value;
  }

  /// The first number of a tag; 0 where it is not there or of another type.
  double number(std::size_t directory, Tag tag) const {
    constexpr std::uint64_t kShort = 3, kLong = 4, kRational = 5;
    for (std::size_t i = 0; i < whole(directory, 2); ++i) {
      const std::size_t entry = directory + 2 + 12 * i;
      if (whole(entry, 2) != tag) continue;
      const std::uint64_t type = whole(entry + 2, 2);
      if (type == kShort) return static_cast<double>(whole(entry + 8, 2));
      if (type == kLong) return static_cast<double>(whole(entry + 8, 4));
      if (type != kRational) return 0.0;
      const auto at = static_cast<std::size_t>(whole(entry + 8, 4));
      const std::uint64_t denominator = whole(at + 4, 4);
      if (denominator == 0) return 0.0;
      return static_cast<double>(whole(at, 4)) / static_cast<double>(denominator);
    }
    return 0.0;
  }

 private:
  std::string_view bytes_;
  bool is_big_;
};

/// The content of the segment that holds Exif data (ITU-T T.81, B.1.1.4); empty if there is none.
std::string_view find_exif(std::string_view jpeg) {
  const auto byte = [jpeg](std::size_t at) {
    return static_cast<std::size_t>(static_cast<unsigned char>(jpeg[at]));
  };
  if (jpeg.substr(0, 2) != "\xFF\xD8") return {};
  for (std::size_t at = 2; at + 4 <= jpeg.size() && byte(at) == 0xFF;) {
    constexpr std::size_t kApplication1 = 0xE1, kStartOfScan = 0xDA;
    const std::size_t length = byte(at + 2) << 8 | byte(at + 3);
    if (length < 2 || byte(at + 1) == kStartOfScan) return {};
    const std::string_view content = jpeg.substr(at + 4, length - 2);
    if (byte(at + 1) == kApplication1 && content.starts_with(kExifStart)) {
      return content.substr(kExifStart.size());
    }
    at += 2 + length;
  }
  return {};
}

/// From the length in mm and the sensor's pixels per inch or cm, those that were counted.
double focal_px_of_sensor(const TiffReader& reader, std::size_t directory) {
  constexpr double kCentimetre = 3.0;
  const double mm_per_unit =
      reader.number(directory, kSensorUnit) == kCentimetre ? 10.0 : 25.4;  // Inch by default.
  return reader.number(directory, kFocalLengthMm) * reader.number(directory, kSensorPixelsPerUnit) /
         mm_per_unit;
}

}  // namespace

std::optional<double> focal_px_in_exif(std::string_view jpeg, const ImageSize& size) {
  const TiffReader reader(find_exif(jpeg));
  const auto first = static_cast<std::size_t>(reader.whole(4, 4));
  const auto directory = static_cast<std::size_t>(reader.number(first, kExifDirectory));
  if (directory == 0) return std::nullopt;
  const double width = reader.number(directory, kPixelWidth);
  const double height = reader.number(directory, kPixelHeight);
  const double aspect = static_cast<double>(size.width_px) / size.height_px;
  if (width > 0.0 && height > 0.0 && std::abs(width / height / aspect - 1.0) > kMaxAspectError) {
    return std::nullopt;
  }
  const double film_mm = reader.number(directory, kFocalLengthOfFilmMm);
  double focal_px = film_mm / kFilmDiagonalMm * std::hypot(size.width_px, size.height_px);
  if (film_mm == 0.0 && width > 0.0) {
    focal_px = focal_px_of_sensor(reader, directory) * size.width_px / width;
  }
  const double widths = focal_px / size.width_px;
  if (!(widths >= kShortest && widths <= kLongest)) return std::nullopt;
  return focal_px;
}

std::optional<double> read_focal_px(const std::filesystem::path& path, const ImageSize& size) {
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(kMaxBytes, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return focal_px_in_exif(bytes, size);
}

}  // namespace waymark
