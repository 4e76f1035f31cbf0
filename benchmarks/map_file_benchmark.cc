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
#include <fstream>
#include <string>

#include "waymark/io/map_file.h"
#include "waymark/place/place_index.h"

namespace {

using waymark::Keyframe;
using waymark::KeyframeId;
using waymark::Landmark;
using waymark::LandmarkId;
using waymark::Map;
using waymark::MapParts;
using waymark::StoredMap;
using waymark::SubmapId;

/// A line of /proc/self/status in MB.
double memory_mb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key + ":")) return std::atof(line.c_str() + key.size() + 1) / 1024.0;
  }
  return 0.0;
}

/// From now on VmHWM tells the peak since now.
void reset_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

/// Of the processor, so that what else runs does not count.
template <class Task>
double time_ms(const Task& task) {
  const std::clock_t start = std::clock();
  task();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

template <class IdType>
IdType shifted(IdType id, std::uint32_t by) {
  return id.is_valid() ? IdType{id.value + by} : id;
}

/// Appends a copy of the features' bytes too, as if all of it had been seen.
void append(const Map& map, MapParts& parts) {
  const std::uint32_t first_keyframe = parts.end_keyframe.value;
  const std::uint32_t first_landmark = parts.end_landmark.value;
  const auto first_submap = static_cast<std::uint32_t>(parts.submaps.size());
  for (waymark::Submap submap : map.submaps()) {
    submap.root = shifted(submap.root, first_keyframe);
    submap.joined_into = shifted(submap.joined_into, first_submap);
    parts.submaps.push_back(submap);
  }
  map.keyframes().for_each([&](KeyframeId id, Keyframe keyframe) {
    keyframe.submap.value += first_submap;
    keyframe.parent = shifted(keyframe.parent, first_keyframe);
    keyframe.features = std::make_shared<const waymark::Features>(*keyframe.features);
    for (LandmarkId& landmark : keyframe.landmarks) landmark = shifted(landmark, first_landmark);
    parts.keyframes.push_back({shifted(id, first_keyframe), std::move(keyframe)});
  });
  map.landmarks().for_each([&](LandmarkId id, Landmark landmark) {
    landmark.submap.value += first_submap;
    landmark.reference.value += first_keyframe;
    landmark.observations.clear();
    parts.landmarks.push_back({shifted(id, first_landmark), std::move(landmark)});
  });
  map.keyframe_forwarding().for_each([&](KeyframeId id, waymark::KeyframeForwarding forwarding) {
    if (!forwarding.heir.is_valid()) return;
    forwarding.heir.value += first_keyframe;
    parts.erased_keyframes.push_back({shifted(id, first_keyframe), forwarding});
  });
  map.landmark_forwarding().for_each([&](LandmarkId id, LandmarkId survivor) {
    if (!survivor.is_valid()) return;
    parts.merged_landmarks.push_back(
        {shifted(id, first_landmark), shifted(survivor, first_landmark)});
  });
  parts.end_keyframe.value += map.keyframes().end_id().value;
  parts.end_landmark.value += map.landmarks().end_id().value;
}

std::shared_ptr<const Map> repeat(const Map& map, std::size_t num_keyframes) {
  MapParts parts;
  parts.end_keyframe = KeyframeId{0};
  parts.end_landmark = LandmarkId{0};
  while (parts.keyframes.size() < num_keyframes) append(map, parts);
  return Map::restore(std::move(parts)).freeze();
}

void measure(const std::filesystem::path& path, std::size_t num_keyframes) {
  StoredMap stored = waymark::load_map(path);
  stored.map = repeat(*stored.map, num_keyframes);
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
  std::filesystem::remove(file);
  const double check_ms = time_ms([&] { stored.map->broken_invariants(); });
  waymark::PlaceIndex places;
  const double place_ms = time_ms([&] {
    stored.map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      places.add(id, keyframe.submap, keyframe.features->descriptors);
    });
  });
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
