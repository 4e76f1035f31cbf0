// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Reads a saved map and goes through it: sub-maps, keyframes and what they share, landmarks. Writes
// the points of the largest sub-map as PLY.
//
//   waymark_example_read_map MAP.wmap POINTS.ply
#include <cstddef>
#include <cstdio>
#include <exception>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/exchange/export_scene.h"
#include "waymark/exchange/exports.h"
#include "waymark/mapfile/map_file.h"

namespace {

using namespace waymark;

void print_keyframes(const Map& map) {
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const Eigen::Vector3d position_in_world = keyframe.rig_from_world.origin_in_source();
    std::size_t num_landmarks = 0;
    for (const LandmarkId landmark : keyframe.landmarks) num_landmarks += landmark.is_valid();
    std::printf("keyframe %u in sub-map %u at %.3f %.3f %.3f: %zu features, %zu landmarks",
                id.value,
                keyframe.submap.value,
                position_in_world.x(),
                position_in_world.y(),
                position_in_world.z(),
                keyframe.features->size(),
                num_landmarks);
    for (const CovisibilityEdge& edge : map.covisible(id)) {
      std::printf(", %u with %u", edge.num_shared, edge.keyframe.value);
    }
    std::printf("\n");
  });
}

/// How far the map's landmarks are from the keyframes that they were made from, on average.
double mean_distance(const Map& map) {
  double sum = 0.0;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    // References may be gone; resolve() gives the keyframe that stands for one now.
    const Keyframe& keyframe = map.keyframes().at(map.resolve(landmark.reference));
    sum += (keyframe.rig_from_world * landmark.position_in_world).norm();
  });
  return sum / static_cast<double>(map.landmarks().size());
}

int read(const char* path, const char* points) {
  // Checks everything; what is wrong with a file is an InputError that names the place.
  const StoredMap stored = load_map(path);
  const Map& map = *stored.map;
  print_keyframes(map);

  const std::vector<SubmapId> submaps = submaps_by_size(map);
  if (submaps.empty()) throw InputError(path, "has no keyframes, expected some");
  std::printf("%zu landmarks, %.2f %s away on average\n",
              map.landmarks().size(),
              mean_distance(map),
              is_metric(map) ? "m" : "units");

  write_ply(points, make_export_scene(map, submaps[0], stored.images));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s MAP.wmap POINTS.ply\n", argv[0]);
    return 2;
  }
  try {
    return read(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
