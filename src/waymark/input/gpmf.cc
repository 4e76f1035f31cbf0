// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Key, length, value: four letters, a type, the bytes of a sample, the number of samples (16 bits,
// most significant byte first as all numbers), and these, filled up to whole 4 bytes.
#include <algorithm>
#include <bit>

#include "waymark/input/imu_readers.h"

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

/// Nothing of types that no sensor has.
std::vector<double> numbers_of(const Element& element) {
  const bool is_short = element.type == 's' || element.type == 'S';
  const bool is_long = element.type == 'l' || element.type == 'L' || element.type == 'f';
  const std::size_t size = is_short ? 2 : 4;
  std::vector<double> numbers;
  for (std::size_t at = 0; (is_short || is_long) && at + size <= element.data.size(); at += size) {
    const auto bits = static_cast<std::uint32_t>(big_endian(element.data.substr(at, size)));
    numbers.push_back(element.type == 's'   ? static_cast<std::int16_t>(bits)
                      : element.type == 'l' ? static_cast<std::int32_t>(bits)
                      : element.type == 'f' ? std::bit_cast<float>(bits)
                                            : static_cast<double>(bits));
  }
  return numbers;
}

/// A text, which may be filled up with zeros.
std::string text_of(const Element& element) {
  return std::string(element.data.substr(0, element.data.find('\0')));
}

void take_stream(std::string_view rest,
                 const std::string& device,
                 std::vector<GpmfStream>& streams) {
  GpmfStream stream;
  stream.device = device;
  std::vector<double> scales;
  std::optional<Element> last;
  while (const std::optional<Element> element = next_element(rest)) {
    if (element->key == "ORIN") stream.axes = text_of(*element);
    if (element->key == "SCAL") scales = numbers_of(*element);
    if (element->key == "TSMP") stream.num_total = big_endian(element->data.substr(0, 8));
    last = element;
  }
  if (!last) return;
  stream.values = numbers_of(*last);
  if (stream.values.empty() || last->sample_size == 0) return;
  stream.key = last->key;
  const std::size_t num_samples = std::max<std::size_t>(1, last->data.size() / last->sample_size);
  stream.num_values = std::max<std::size_t>(1, stream.values.size() / num_samples);
  for (std::size_t i = 0; i < stream.values.size() && !scales.empty(); ++i) {
    const double scale = scales[std::min(i % stream.num_values, scales.size() - 1)];
    if (scale != 0.0) stream.values[i] /= scale;
  }
  streams.push_back(std::move(stream));
}

void parse_elements(std::string_view rest,
                    std::string device,
                    int depth,
                    std::vector<GpmfStream>& streams) {
  while (const std::optional<Element> element = next_element(rest)) {
    if (element->key == "DVNM") device = text_of(*element);
    if (element->type != 0) continue;
    if (element->key == "STRM") {
      take_stream(element->data, device, streams);
    } else if (depth < kMaxGpmfNesting) {
      parse_elements(element->data, device, depth + 1, streams);
    }
  }
}

}  // namespace

std::vector<GpmfStream> parse_gpmf(std::string_view payload) {
  std::vector<GpmfStream> streams;
  parse_elements(payload, {}, 0, streams);
  return streams;
}

}  // namespace waymark
