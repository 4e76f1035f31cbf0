// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Writes small sound maps, and journals of one of them, for the fuzzers of map files and journals
// to start from: waymark_map_seeds MAP_FOLDER JOURNAL_FOLDER.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "small_map.h"
#include "waymark/base/atomic_file.h"
#include "waymark/mapfile/map_journal.h"

namespace {

/// One, two and three changes.
void write_journals(const std::filesystem::path& folder) {
  using namespace waymark;
  make_output_folder(folder);
  testing::RandomMap random = map_with_journal();
  const std::filesystem::path path = folder / "map.wmap";
  MapJournal journal(path, 0);
  journal.save(small_stored_map(random));
  for (const char* name : {"1", "2", "3"}) {
    random.go_on(20);
    journal.save(small_stored_map(random));
    std::filesystem::copy_file(folder / "map.wmap.journal",
                               folder / name,
                               std::filesystem::copy_options::overwrite_existing);
  }
  std::filesystem::remove(folder / "map.wmap.journal");
  std::filesystem::remove(path);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace waymark;
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s MAP_FOLDER JOURNAL_FOLDER\n", argv[0]);
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    make_output_folder(folder);
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      testing::RandomMap random(seed, 40, 4);
      StoredMap stored = small_stored_map(random);
      if (seed == 1) stored.imu.emplace().is_used = true;
      save_map(folder / (std::to_string(seed) + ".wmap"), stored);
    }
    write_journals(argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
