// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/image_header.h"

#include <algorithm>
#include <array>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "waymark/base/crc32.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1A\n";
constexpr std::size_t kPngColorAt = 25;
constexpr std::uint64_t kPngIndexed = 3;

enum class ByteOrder { kLittle, kBig };

/// Whole numbers anywhere in bytes; what is beyond the end reads as 0, which no image is high.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, ByteOrder order) : bytes_(bytes), order_(order) {}

  std::uint64_t whole(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || bytes_.size() - at < count) return 0;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t place = order_ == ByteOrder::kBig ? i : count - 1 - i;
      value = value << 8 | static_cast<unsigned char>(bytes_[at + place]);
    }
    return value;
  }

 private:
  std::string_view bytes_;
  ByteOrder order_;
};

std::optional<ImageSize> size_of(std::uint64_t width, std::uint64_t height) {
  if (width == 0 || height == 0 || width > INT_MAX || height > INT_MAX) return std::nullopt;
  return ImageSize{static_cast<int>(width), static_cast<int>(height)};
}

std::optional<ImageSize> png_size(std::string_view bytes) {
  const ByteReader reader(bytes, ByteOrder::kBig);
  return size_of(reader.whole(16, 4), reader.whole(20, 4));
}

/// Whether a PNG file begins with a header that images can have (ISO/IEC 15948, 11.2.2).
bool is_possible_png_start(std::string_view bytes) {
  constexpr std::size_t kHeaderEnd = 33;
  const ByteReader reader(bytes, ByteOrder::kBig);
  if (bytes.size() < kHeaderEnd || reader.whole(8, 4) != 13 || bytes.substr(12, 4) != "IHDR") {
    return false;
  }
  const std::uint64_t depth = reader.whole(24, 1), color = reader.whole(kPngColorAt, 1);
  const bool is_byte = depth == 8;
  const bool is_small = depth == 1 || depth == 2 || depth == 4;
  const bool has_depth = color == 0             ? is_small || is_byte || depth == 16
                         : color == kPngIndexed ? is_small || is_byte
                                                : is_byte || depth == 16;
  const bool is_color =
      color == 0 || color == 2 || color == kPngIndexed || color == 4 || color == 6;
  return is_color && has_depth && reader.whole(26, 2) == 0 && reader.whole(28, 1) <= 1;
}

/// Walks the segments to the start of a frame (ITU-T T.81, B.1.1.4).
std::optional<ImageSize> jpeg_size(std::string_view bytes) {
  const ByteReader reader(bytes, ByteOrder::kBig);
  for (std::size_t at = 2; at + 9 < bytes.size();) {
    if (reader.whole(at, 1) != 0xFF) return std::nullopt;
    const std::uint64_t marker = reader.whole(at + 1, 1);
    if (marker == 0xFF) {  // Fills up.
      ++at;
      continue;
    }
    const bool is_other = marker == 0xC4 || marker == 0xC8 || marker == 0xCC;
    if (marker >= 0xC0 && marker <= 0xCF && !is_other) {
      return size_of(reader.whole(at + 7, 2), reader.whole(at + 5, 2));
    }
    const bool is_alone = marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8);
    at += is_alone ? 2 : 2 + static_cast<std::size_t>(reader.whole(at + 2, 2));
  }
  return std::nullopt;
}

/// The tags ImageWidth and ImageLength of the first directory (TIFF 6.0; BigTIFF is not read).
std::optional<ImageSize> tiff_size(std::string_view bytes) {
  constexpr std::uint64_t kWidth = 256, kLength = 257, kShort = 3, kLong = 4;
  const ByteReader reader(bytes, bytes[0] == 'M' ? ByteOrder::kBig : ByteOrder::kLittle);
  const auto directory = static_cast<std::size_t>(reader.whole(4, 4));
  std::uint64_t width = 0, height = 0;
  for (std::size_t i = 0; i < reader.whole(directory, 2); ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    const std::uint64_t tag = reader.whole(entry, 2), type = reader.whole(entry + 2, 2);
    if (type != kShort && type != kLong) continue;
    const std::uint64_t value = reader.whole(entry + 8, type == kShort ? 2 : 4);
    if (tag == kWidth) width = value;
    if (tag == kLength) height = value;
  }
  return size_of(width, height);
}

std::optional<ImageSize> bmp_size(std::string_view bytes) {
  constexpr std::uint64_t kOldHeader = 12;
  const ByteReader reader(bytes, ByteOrder::kLittle);
  if (reader.whole(14, 4) == kOldHeader) return size_of(reader.whole(18, 2), reader.whole(20, 2));
  // A negative height means rows from top to bottom.
  const auto height = static_cast<std::int32_t>(reader.whole(22, 4));
  return size_of(reader.whole(18, 4),
                 static_cast<std::uint64_t>(std::abs(static_cast<std::int64_t>(height))));
}

/// RFC 9649: lossy, lossless, or extended.
std::optional<ImageSize> webp_size(std::string_view bytes) {
  const ByteReader reader(bytes, ByteOrder::kLittle);
  const std::string_view kind = bytes.substr(12, 4);
  if (kind == "VP8 ") return size_of(reader.whole(26, 2) & 0x3FFF, reader.whole(28, 2) & 0x3FFF);
  if (kind == "VP8X") return size_of(reader.whole(24, 3) + 1, reader.whole(27, 3) + 1);
  if (kind != "VP8L") return std::nullopt;
  const std::uint64_t sizes = reader.whole(21, 4);
  return size_of((sizes & 0x3FFF) + 1, (sizes >> 14 & 0x3FFF) + 1);
}

/// The two numbers after P1 ... P6, between which there may be comments.
std::optional<ImageSize> pnm_size(std::string_view bytes) {
  std::array<std::uint64_t, 2> sizes{};
  std::size_t at = 2;
  for (std::uint64_t& size : sizes) {
    for (; at < bytes.size() && !is_digit(bytes[at]); ++at) {
      if (bytes[at] == '#') at = std::min(bytes.find('\n', at), bytes.size() - 1);
    }
    for (; at < bytes.size() && is_digit(bytes[at]) && size <= INT_MAX; ++at) {
      size = 10 * size + static_cast<std::uint64_t>(bytes[at] - '0');
    }
  }
  return size_of(sizes[0], sizes[1]);
}

}  // namespace

bool is_png(std::string_view bytes) { return bytes.starts_with(kPngSignature); }

std::optional<ImageSize> size_in_header(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (is_png(bytes)) return png_size(bytes);
  if (bytes.starts_with("\xFF\xD8\xFF")) return jpeg_size(bytes);
  if (bytes.starts_with("II\x2A\0"sv) || bytes.starts_with("MM\0\x2A"sv)) return tiff_size(bytes);
  if (bytes.starts_with("BM")) return bmp_size(bytes);
  if (bytes.size() > 12 && bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WEBP") {
    return webp_size(bytes);
  }
  const bool is_pnm = bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6';
  return is_pnm ? pnm_size(bytes) : std::nullopt;
}

std::optional<std::string> pixels_of_png(std::string_view bytes) {
  constexpr std::size_t kOverhead = 12;
  const ByteReader reader(bytes, ByteOrder::kBig);
  if (!is_possible_png_start(bytes)) return std::nullopt;
  const bool has_palette = reader.whole(kPngColorAt, 1) == kPngIndexed;
  std::string pixels(kPngSignature);
  for (std::size_t at = kPngSignature.size(); at + kOverhead <= bytes.size();) {
    const auto length = static_cast<std::size_t>(reader.whole(at, 4));
    if (length > bytes.size() - at - kOverhead) return std::nullopt;
    const std::string_view kind = bytes.substr(at + 4, 4);
    const std::string_view chunk = bytes.substr(at, kOverhead + length);
    at += chunk.size();
    if (crc32(chunk.substr(4, 4 + length)) != reader.whole(at - 4, 4)) return std::nullopt;
    const bool is_kept =
        kind == "IHDR" || kind == "IDAT" || kind == "IEND" || (kind == "PLTE" && has_palette);
    if (is_kept) pixels += chunk;
    if (kind == "IEND") return pixels;
  }
  return std::nullopt;
}

}  // namespace waymark
