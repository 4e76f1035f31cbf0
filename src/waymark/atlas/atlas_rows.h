// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <sqlite3.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/bag/sqlite_file.h"
#include "waymark/base/check.h"
#include "waymark/base/sha256.h"
#include "waymark/mapfile/map_layout.h"

namespace waymark {

/// A statement with its parameters and the values of its current row, each asked for with what it
/// may be.
class AtlasRows {
 public:
  AtlasRows(sqlite3* base, const std::filesystem::path& path, const char* sql)
      : base_(base), path_(path), what_(sql), statement_(prepare_sqlite(base, sql)) {
    if (!statement_) {
      throw InputError(path.string(), "cannot be read, expected the data base of an atlas");
    }
  }

  AtlasRows& add(const std::string& value) {
    sqlite3_bind_text(statement_.get(),
                      ++parameter_,
                      value.data(),
                      static_cast<int>(value.size()),
                      SQLITE_TRANSIENT);
    return *this;
  }
  AtlasRows& add(std::int64_t value) {
    sqlite3_bind_int64(statement_.get(), ++parameter_, value);
    return *this;
  }
  AtlasRows& add(double value) {
    if (!std::isfinite(value)) throw OutputError(path_.string(), "would hold what is not finite");
    sqlite3_bind_double(statement_.get(), ++parameter_, value);
    return *this;
  }
  AtlasRows& add(const SharedLandmarks& landmarks) {
    std::vector<std::uint32_t> ids;
    for (const auto& [a, b] : landmarks) ids.insert(ids.end(), {a.value, b.value});
    sqlite3_bind_blob64(
        statement_.get(), ++parameter_, ids.data(), ids.size() * sizeof(ids[0]), SQLITE_TRANSIENT);
    return *this;
  }
  AtlasRows& add(const Sim3& transform) {
    for (const double value : transform.rotation.coeffs()) add(value);
    for (const double value : transform.translation) add(value);
    return add(transform.scale);
  }
  void run() {
    if (sqlite3_step(statement_.get()) != SQLITE_DONE) {
      throw OutputError(path_.string(), std::string("cannot be written: ") + sqlite3_errmsg(base_));
    }
    sqlite3_reset(statement_.get());
    parameter_ = 0;
  }

  /// Steps to the next row.
  bool next() {
    column_ = -1;
    const int status = sqlite3_step(statement_.get());
    if (status != SQLITE_ROW && status != SQLITE_DONE) {
      throw InputError(path_.string(),
                       std::string("is damaged: ") + sqlite3_errmsg(base_) +
                           ", expected the data base of an atlas");
    }
    return status == SQLITE_ROW;
  }
  std::int64_t whole(const char* name, std::int64_t max) {
    const std::int64_t value = sqlite3_column_int64(statement_.get(), ++column_);
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_INTEGER || value < 0 ||
        value > max) {
      fail(name, fmt::format("expected a whole number of at most {}", max));
    }
    return value;
  }
  double number(const char* name, const NumberRange& range) {
    const double value = sqlite3_column_double(statement_.get(), ++column_);
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_FLOAT || !range.contains(value)) {
      fail(name, "expected a number that is possible");
    }
    return value;
  }
  std::string text(const char* name) {
    const auto* value =
        reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), ++column_));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column_));
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_TEXT || !value ||
        size > kMaxTextBytes) {
      fail(name, "expected a text");
    }
    return {value, size};
  }
  std::string checksum(const char* name) {
    std::string value = text(name);
    if (!is_sha256(value)) fail(name, "expected a SHA-256 checksum");
    return value;
  }
  Sim3 transform() {
    Sim3 transform;
    for (double& value : transform.rotation.coeffs()) value = number("rotation", {-2.0, 2.0});
    if (std::abs(transform.rotation.norm() - 1.0) > kMaxNormError) {
      fail("rotation", "expected a unit quaternion");
    }
    for (double& value : transform.translation) value = number("translation", kLengthRange);
    transform.scale = number("scale", kScaleRange);
    return transform;
  }
  SharedLandmarks landmarks() {
    const void* bytes = sqlite3_column_blob(statement_.get(), ++column_);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column_));
    constexpr std::size_t kPairBytes = 2 * sizeof(std::uint32_t);
    if (sqlite3_column_type(statement_.get(), column_) != SQLITE_BLOB || size % kPairBytes != 0) {
      fail("landmarks", "expected pairs of numbers");
    }
    std::vector<std::uint32_t> ids(size / sizeof(std::uint32_t));
    if (size > 0) std::memcpy(ids.data(), bytes, size);
    SharedLandmarks landmarks;
    for (std::size_t i = 0; i < ids.size(); i += 2) {
      if (ids[i] >= kMaxIds || ids[i + 1] >= kMaxIds) fail("landmarks", "expected ids");
      landmarks.push_back({LandmarkId{ids[i]}, LandmarkId{ids[i + 1]}});
    }
    return landmarks;
  }
  /// The message names the statement, which says table and column.
  [[noreturn]] void fail(const char* name, const std::string& expected) const {
    throw InputError(path_.string(), fmt::format("{} of a row of '{}': {}", name, what_, expected));
  }

 private:
  sqlite3* base_;
  const std::filesystem::path& path_;
  const char* what_;
  SqliteStatement statement_;
  int parameter_ = 0;
  int column_ = -1;
};

}  // namespace waymark
