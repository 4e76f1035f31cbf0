// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/exchange/openvslam_map.h"

namespace {

/// SQLite reads files only.
waymark::ImportedMap import_database(std::string_view bytes) {
  static const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("waymark_fuzz_map_" + std::to_string(getpid()));
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return waymark::import_openvslam_file(path);
}

}  // namespace

/// Whatever the bytes are: a sound map, or an InputError.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const waymark::ImportedMap imported = bytes.starts_with("SQLite format 3")
                                              ? import_database(bytes)
                                              : waymark::import_openvslam_map(bytes, "map.msg");
    WAYMARK_CHECK(imported.map.broken_invariants().empty());
  } catch (const waymark::InputError&) {
  }
  return 0;
}
