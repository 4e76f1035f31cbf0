// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A large map to measure with, in which only the given part is ever recognised:
//   waymark_enlarge_map MAP NUM_KEYFRAMES OUT
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "repeated_map.h"
#include "waymark/mapfile/map_file.h"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s MAP NUM_KEYFRAMES OUT\n", argv[0]);
    return 2;
  }
  try {
    waymark::StoredMap stored = waymark::load_map(argv[1]);
    stored.map = waymark::repeat_map(*stored.map, std::strtoul(argv[2], nullptr, 10));
    stored.images.clear();
    waymark::save_map(argv[3], stored);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
