// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// How long a map takes to save and to load, and how much memory saving needs:
//   waymark_map_file_benchmark MAP [NUM_KEYFRAMES]
// The map is laid out beside itself until it has so many keyframes (1000), as further sub-maps.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <string>

#include "memory.h"
#include "repeated_map.h"
#include "waymark/base/text.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/place/place_index.h"

namespace {

using waymark::Keyframe;
using waymark::KeyframeId;
using waymark::memory_mb;
using waymark::reset_peak;
using waymark::StoredMap;

/// Of the processor, so that what else runs does not count.
template <class Task>
double time_ms(const Task& task) {
  const std::clock_t start = std::clock();
  task();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void measure(const std::filesystem::path& path, std::size_t num_keyframes) {
  StoredMap stored = waymark::load_map(path);
  stored.map = waymark::repeat_map(*stored.map, num_keyframes, true);
  stored.settings.clear();
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("waymark_benchmark." + std::to_string(getpid()));
  reset_peak();
  const double map_mb = memory_mb("VmRSS");
  const double save_ms = time_ms([&] { waymark::save_map(file, stored); });
  std::printf("%zu keyframes, %zu landmarks: file of %.1f MB\n",
              stored.map->keyframes().size(),
              stored.map->landmarks().size(),
              1e-6 * static_cast<double>(std::filesystem::file_size(file)));
  std::printf("save %.0f ms, memory %.1f MB before, %.1f MB at its peak\n",
              save_ms,
              map_mb,
              memory_mb("VmHWM"));
  stored = {};
  const double load_ms = time_ms([&] { stored = waymark::load_map(file); });
  const std::string bytes = waymark::read_text_file(file, "a map");
  waymark::save_map(file, stored);
  const bool is_same = waymark::read_text_file(file, "a map") == bytes;
  std::filesystem::remove(file);
  const double check_ms = time_ms([&] { stored.map->broken_invariants(); });
  waymark::PlaceIndex places;
  const double place_ms = time_ms([&] {
    stored.map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      places.add(id, keyframe.submap, keyframe.features->descriptors);
    });
  });
  std::printf("saved again: %s bytes\n", is_same ? "the same" : "other");
  std::printf("load %.0f ms, of which checking the map %.0f ms; place index %.0f ms\n",
              load_ms,
              check_ms,
              place_ms);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: %s MAP [NUM_KEYFRAMES]\n", argv[0]);
    return 2;
  }
  try {
    measure(argv[1], argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 1000);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
