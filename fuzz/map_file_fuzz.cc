// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The reader of map files: whatever the bytes, it gives a sound map or an InputError.
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/testing/map_checksums.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace waymark;
  // Checksums are made right, else no edit would get past them.
  auto records = testing::split_records({reinterpret_cast<const char*>(data), size});
  for (std::string& record : records) {
    if (record.find("crc32c") != std::string::npos) testing::seal_record(record);
  }
  std::istringstream stream(testing::join_records(records));
  try {
    const StoredMap stored = read_map(stream, "fuzz");
    WAYMARK_CHECK(stored.map->broken_invariants().empty());
  } catch (const InputError& error) {
    WAYMARK_CHECK(std::string_view(error.what()).find("\n") == std::string_view::npos);
  }
  return 0;
}
