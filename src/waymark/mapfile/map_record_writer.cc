// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_record_writer.h"

#include <bit>
#include <msgpack.hpp>

#include "waymark/mapfile/crc32c.h"

namespace waymark {
namespace {

/// What msgpack's packer writes to.
struct Sink {
  std::string& bytes;
  void write(const char* data, std::size_t size) { bytes.append(data, size); }
};

template <class Pack>
void pack(std::string& bytes, const Pack& pack_into) {
  Sink sink{bytes};
  msgpack::packer<Sink> packer(sink);
  pack_into(packer);
}

void pack_text(std::string& bytes, std::string_view text) {
  const auto size = static_cast<std::uint32_t>(text.size());
  pack(bytes, [&](auto& packer) { packer.pack_str(size).pack_str_body(text.data(), size); });
}

void pack_bytes(std::string& bytes, std::string_view data) {
  const auto size = static_cast<std::uint32_t>(data.size());
  pack(bytes, [&](auto& packer) { packer.pack_bin(size).pack_bin_body(data.data(), size); });
}

/// Always as a float 64: the packer would make an integer of whole numbers, which loses the sign of
/// zero and gives readers two types.
void pack_number(std::string& bytes, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  bytes.push_back('\xcb');
  for (int shift = 56; shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<char>((bits >> shift) & 0xFF));
  }
}

void pack_numbers(std::string& bytes, std::span<const double> values) {
  pack(bytes, [&](auto& packer) { packer.pack_array(static_cast<std::uint32_t>(values.size())); });
  for (const double value : values) pack_number(bytes, value);
}

void pack_map_size(std::string& bytes, std::uint32_t num_keys) {
  pack(bytes, [&](auto& packer) { packer.pack_map(num_keys); });
}

}  // namespace

void MapRecordWriter::write_header(int version, std::string_view producer) {
  add_text("format", "waymark-map");
  add("version", static_cast<std::uint64_t>(version));
  add_text("producer", producer);
  add_text("conventions",
           "b_from_a maps points of a into b; cameras look along +z, x right, y down; pixel (0, 0) "
           "is the centre of the top-left one; metres, radians, nanoseconds; quaternions x y z w");
  end();
}

void MapRecordWriter::begin(std::string_view kind, std::uint64_t id) {
  add_text("kind", kind);
  add("id", id);
  ++counts_[std::string(kind)];
}

void MapRecordWriter::add(std::string_view key, std::uint64_t value) {
  add_key(key);
  pack(body_, [&](auto& packer) { packer.pack_uint64(value); });
}

void MapRecordWriter::add_signed(std::string_view key, std::int64_t value) {
  add_key(key);
  pack(body_, [&](auto& packer) { packer.pack_int64(value); });
}

void MapRecordWriter::add_flag(std::string_view key, bool value) {
  add_key(key);
  pack(body_, [&](auto& packer) { value ? packer.pack_true() : packer.pack_false(); });
}

void MapRecordWriter::add_text(std::string_view key, std::string_view value) {
  add_key(key);
  pack_text(body_, value);
}

void MapRecordWriter::add_bytes(std::string_view key, std::string_view value) {
  add_key(key);
  pack_bytes(body_, value);
}

void MapRecordWriter::add_number(std::string_view key, double value) {
  add_key(key);
  pack_number(body_, value);
}

void MapRecordWriter::add_numbers(std::string_view key, std::span<const double> values) {
  add_key(key);
  pack_numbers(body_, values);
}

void MapRecordWriter::add_transform(std::string_view key, const Rigid3& transform) {
  add_key(key);
  pack_map_size(body_, 2);
  pack_text(body_, "rotation");
  pack_numbers(body_, std::span(transform.rotation.coeffs().data(), 4));
  pack_text(body_, "translation");
  pack_numbers(body_, std::span(transform.translation.data(), 3));
}

void MapRecordWriter::end() {
  add_key("crc32c");
  std::string start;
  pack_map_size(start, num_keys_);
  const std::uint32_t checksum = crc32c(body_, crc32c(start));
  pack(body_, [&](auto& packer) { packer.pack_fix_uint32(checksum); });
  file_.write(start);
  file_.write(body_);
  body_.clear();
  num_keys_ = 0;
}

void MapRecordWriter::write_counts() {
  add_text("kind", "end");
  add_key("counts");
  pack_map_size(body_, static_cast<std::uint32_t>(counts_.size()));
  for (const auto& [kind, count] : counts_) {
    pack_text(body_, kind);
    pack(body_, [count = count](auto& packer) { packer.pack_uint64(count); });
  }
  end();
}

void MapRecordWriter::add_key(std::string_view key) {
  ++num_keys_;
  pack_text(body_, key);
}

void MapRecordWriter::add_nothing(std::string_view key) {
  add_key(key);
  pack(body_, [](auto& packer) { packer.pack_nil(); });
}

void MapRecordWriter::add_raw_array(std::string_view key,
                                    const MapArrayLayout& layout,
                                    std::size_t count,
                                    std::string_view bytes) {
  add_key(key);
  pack_map_size(body_, 3);
  pack_text(body_, "dtype");
  pack_text(body_, layout.dtype);
  pack_text(body_, "shape");
  pack(body_, [&](auto& packer) {
    packer.pack_array(static_cast<std::uint32_t>(1 + layout.element_shape.size()));
    packer.pack_uint64(count);
    for (const std::size_t size : layout.element_shape) packer.pack_uint64(size);
  });
  pack_text(body_, "data");
  pack_bytes(body_, bytes);
}

}  // namespace waymark
