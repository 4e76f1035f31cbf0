// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The reader of journals, with the map that the seeds belong to: whatever the bytes, it gives a
// sound map or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>

#include "small_map.h"
#include "waymark/base/check.h"
#include "waymark/mapfile/testing/map_checksums.h"

namespace {

/// The bytes of the map of map_seeds.cc.
std::string map_file() {
  using namespace waymark;
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "waymark_map_journal_fuzz.wmap";
  testing::RandomMap random = map_with_journal();
  save_map(path, small_stored_map(random));
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace waymark;
  static const std::string kMap = map_file();
  // Checksums are made right, else no edit would get past them.
  auto records = testing::split_records({reinterpret_cast<const char*>(data), size});
  for (std::string& record : records) {
    if (record.find("crc32c") != std::string::npos) testing::seal_record(record);
  }
  std::istringstream map(kMap), journal(testing::join_records(records));
  try {
    const StoredMap stored = read_map(map, journal, "fuzz");
    WAYMARK_CHECK(stored.map->broken_invariants().empty());
  } catch (const InputError& error) {
    WAYMARK_CHECK(std::string_view(error.what()).find("\n") == std::string_view::npos);
  }
  return 0;
}
