// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Writes small sound maps for the fuzzer of map files to start from: waymark_map_seeds FOLDER.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>

#include "waymark/base/atomic_file.h"
#include "waymark/map/testing/random_map.h"
#include "waymark/mapfile/map_file.h"

int main(int argc, char** argv) {
  using namespace waymark;
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    make_output_folder(folder);
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      StoredMap stored;
      stored.map = testing::RandomMap(seed, 40, 4).map().freeze();
      stored.images[stored.map->submaps()[0].root] = std::make_shared<const std::string>("jpeg");
      save_map(folder / (std::to_string(seed) + ".wmap"), stored);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
