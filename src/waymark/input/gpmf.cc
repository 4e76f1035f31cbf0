// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Key, length, value: four letters, a type, the bytes of a sample, the number of samples (16 bits,
// most significant byte first as all numbers), and these, filled up to whole 4 bytes.
#include "waymark/input/gpmf.h"

#include <algorithm>
#include <bit>

namespace waymark {
namespace {

constexpr int kMaxGpmfNesting = 8;

struct Element {
  std::string_view key;
  char type = 0;  ///< 0: holds other elements.
  std::size_t sample_size = 0;
  std::string_view data;
};

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<unsigned char>(byte);
  return value;
}

/// Takes the next element; nothing at the end, and for what is none.
std::optional<Element> next_element(std::string_view& rest) {
  constexpr std::size_t kHead = 8;
  if (rest.size() < kHead) return std::nullopt;
  Element element{rest.substr(0, 4), rest[4], static_cast<unsigned char>(rest[5]), {}};
  if (element.key == std::string_view("\0\0\0\0", 4)) return std::nullopt;  // Filled up.
  const std::size_t size = element.sample_size * big_endian(rest.substr(6, 2));
  if (size > rest.size() - kHead) return std::nullopt;
  element.data = rest.substr(kHead, size);
  rest.remove_prefix(std::min(rest.size(), kHead + (size + 3) / 4 * 4));
  return element;
}

/// Bytes of a number; 0: of that type there is none.
std::size_t size_of_type(char type) {
  switch (type) {
    case 'b':
    case 'B':
      return 1;
    case 's':
    case 'S':
      return 2;
    case 'l':
    case 'L':
    case 'f':
    case 'q':
      return 4;
    case 'j':
    case 'J':
    case 'd':
    case 'Q':
      return 8;
    default:
      return 0;
  }
}

double number_of(char type, std::string_view bytes) {
  const std::uint64_t value = big_endian(bytes);
  switch (type) {
    case 'b':
      return static_cast<std::int8_t>(value);
    case 's':
      return static_cast<std::int16_t>(value);
    case 'l':
      return static_cast<std::int32_t>(value);
    case 'j':
      return static_cast<double>(static_cast<std::int64_t>(value));
    case 'f':
      return std::bit_cast<float>(static_cast<std::uint32_t>(value));
    case 'd':
      return std::bit_cast<double>(value);
    case 'q':
      return static_cast<std::int32_t>(value) / 65536.0;
    case 'Q':
      return static_cast<double>(static_cast<std::int64_t>(value)) / 4294967296.0;
    default:
      return static_cast<double>(value);
  }
}

std::vector<double> numbers_of(const Element& element) {
  std::vector<double> numbers;
  const std::size_t size = size_of_type(element.type);
  for (std::size_t at = 0; size > 0 && at + size <= element.data.size(); at += size) {
    numbers.push_back(number_of(element.type, element.data.substr(at, size)));
  }
  return numbers;
}

/// A text, which may be filled up with zeros.
std::string text_of(const Element& element) {
  return std::string(element.data.substr(0, element.data.find('\0')));
}

class GpmfParser {
 public:
  void parse(std::string_view rest, const std::string& outer_device, int depth) {
    std::string device = outer_device;
    while (const std::optional<Element> element = next_element(rest)) {
      if (element->type == 0) {
        if (element->key == "STRM") {
          take_stream(element->data, device);
        } else if (depth < kMaxGpmfNesting) {
          parse(element->data, device, depth + 1);
        }
      } else if (element->key == "DVNM") {
        device = text_of(*element);
      }
    }
  }

  std::vector<GpmfStream> streams;

 private:
  void take_stream(std::string_view rest, const std::string& device) {
    GpmfStream stream;
    stream.device = device;
    std::vector<double> scales;
    std::optional<Element> last;
    while (const std::optional<Element> element = next_element(rest)) {
      if (element->key == "STNM") stream.name = text_of(*element);
      if (element->key == "SIUN" || element->key == "UNIT") stream.unit = text_of(*element);
      if (element->key == "ORIN") stream.axes = text_of(*element);
      if (element->key == "SCAL") scales = numbers_of(*element);
      const bool has_one = size_of_type(element->type) > 0 && !element->data.empty();
      if (element->key == "STMP" && has_one)
        stream.stamp_us = big_endian(element->data.substr(0, 8));
      if (element->key == "TSMP" && has_one)
        stream.num_total = big_endian(element->data.substr(0, 8));
      last = element;
    }
    if (!last) return;
    const std::size_t size = size_of_type(last->type);
    if (size == 0 || last->sample_size < size) return;
    stream.key = last->key;
    stream.num_values = last->sample_size / size;
    stream.values = numbers_of(*last);
    for (std::size_t i = 0; i < stream.values.size(); ++i) {
      const std::size_t of_sample = i % stream.num_values;
      const double scale = of_sample < scales.size() ? scales[of_sample]
                           : scales.size() == 1      ? scales[0]
                                                     : 1.0;
      if (scale != 0.0) stream.values[i] /= scale;
    }
    streams.push_back(std::move(stream));
  }
};

}  // namespace

std::vector<GpmfStream> parse_gpmf(std::string_view payload) {
  GpmfParser parser;
  parser.parse(payload, {}, 0);
  return std::move(parser.streams);
}

}  // namespace waymark
