// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_record_writer.h"

#include <fmt/format.h>

#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/crc32.h"

namespace waymark {

void MapRecordWriter::write_header(int version, std::string_view producer) {
  add_text("format", "waymark-map");
  add("version", static_cast<std::uint64_t>(version));
  add_text("producer", producer);
  add_text("conventions",
           "b_from_a maps points of a into b; cameras look along +z, x right, y down; pixel (0, 0) "
           "is the centre of the top-left one; metres, radians, nanoseconds; quaternions x y z w");
  end();
}

void MapRecordWriter::write_journal_header(int version,
                                           std::string_view producer,
                                           std::uint32_t map_checksum) {
  add_text("format", "waymark-map-journal");
  add("version", static_cast<std::uint64_t>(version));
  add_text("producer", producer);
  add("map_checksum", map_checksum);
  end();
}

void MapRecordWriter::begin(std::string_view kind, std::uint64_t id) {
  record_ = fmt::format("{} {}", kind, id);
  add_text("kind", kind);
  add("id", id);
  ++counts_[std::string(kind)];
}

void MapRecordWriter::fail(const std::string& what) const {
  throw OutputError(fmt::format("{}: {}", name_, record_), what + "; the file stays as it was");
}

void MapRecordWriter::fail(std::string_view key, double value) const {
  fail(fmt::format("{} would hold {:g}, expected what is finite and possible", key, value));
}

void MapRecordWriter::add_number(std::string_view key, double value, const NumberRange& range) {
  if (!range.contains(value)) fail(key, value);
  pack_number(add_key(key), value);
}

void MapRecordWriter::add_transform(std::string_view key, const Rigid3& transform) {
  for (const double value : transform.translation) {
    if (!std::isfinite(value)) fail(key, value);
  }
  const double norm = transform.rotation.norm();
  if (!(std::abs(norm - 1.0) <= kMaxNormError)) fail(key, norm);
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
  pack_uint32(body_, checksum);
  checksum_ = crc32c(std::string_view(body_).substr(body_.size() - sizeof checksum), checksum_);
  write_(start);
  write_(body_);
  body_.clear();
  num_keys_ = 0;
}

void MapRecordWriter::write_counts() {
  add_text("kind", "end");
  add_key("counts");
  pack_map_size(body_, counts_.size());
  for (const auto& [kind, count] : counts_) {
    pack_text(body_, kind);
    pack_unsigned(body_, count);
  }
  end();
  counts_.clear();
}

std::string& MapRecordWriter::add_key(std::string_view key) {
  ++num_keys_;
  pack_text(body_, key);
  return body_;
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
  pack_array_size(body_, 1 + layout.element_shape.size());
  pack_unsigned(body_, count);
  for (const std::size_t size : layout.element_shape) pack_unsigned(body_, size);
  pack_text(body_, "data");
  pack_bytes(body_, bytes);
}

}  // namespace waymark
