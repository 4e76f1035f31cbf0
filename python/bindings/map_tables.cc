// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The whole of a map as arrays. They are copies: the engine keeps keyframes and landmarks in pages.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <cstddef>
#include <optional>
#include <unordered_map>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "waymark/exchange/export_scene.h"
#include "waymark/map/parts.h"

namespace waymark::python {
namespace {

struct KeyframeTable {
  py::array ids, frames, timestamps_ns, world_from_rig, submaps, parents;
};

struct LandmarkTable {
  py::array ids, positions_in_world, submaps, num_observers, num_visible, num_found;
};

struct MarkerTable {
  py::array ids, sides_m, world_from_marker, submaps, is_surveyed;
};

struct MarkerObservationTable {
  py::array keyframes, ids, cameras, pixels;
};

KeyframeTable keyframes(const PythonMap& self) {
  std::vector<std::uint32_t> ids, frames, submaps, parents;
  std::vector<std::int64_t> timestamps_ns;
  std::vector<double> poses;
  self.map().keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    ids.push_back(id.value);
    frames.push_back(keyframe.frame.value);
    timestamps_ns.push_back(keyframe.timestamp_ns);
    append_matrix(keyframe.rig_from_world.inverse(), poses);
    submaps.push_back(keyframe.submap.value);
    parents.push_back(keyframe.parent.value);
  });
  const auto count = static_cast<py::ssize_t>(ids.size());
  return {array_of(std::move(ids)),
          array_of(std::move(frames)),
          array_of(std::move(timestamps_ns)),
          array_of(std::move(poses), {count, 4, 4}),
          array_of(std::move(submaps)),
          array_of(std::move(parents))};
}

LandmarkTable landmarks(const PythonMap& self) {
  std::vector<std::uint32_t> ids, submaps, observers, visible, found;
  std::vector<double> positions;
  self.map().landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    ids.push_back(id.value);
    const Eigen::Vector3d& position = landmark.position_in_world;
    positions.insert(positions.end(), position.begin(), position.end());
    submaps.push_back(landmark.submap.value);
    observers.push_back(static_cast<std::uint32_t>(num_observers(landmark)));
    visible.push_back(landmark.num_visible);
    found.push_back(landmark.num_found);
  });
  const auto count = static_cast<py::ssize_t>(ids.size());
  return {array_of(std::move(ids)),
          array_of(std::move(positions), {count, 3}),
          array_of(std::move(submaps)),
          array_of(std::move(observers)),
          array_of(std::move(visible)),
          array_of(std::move(found))};
}

MarkerTable markers(const PythonMap& self) {
  std::vector<std::uint32_t> ids, submaps;
  std::vector<double> sides, poses;
  std::vector<std::uint8_t> is_surveyed;
  for (const MapMarker& marker : self.map().markers()) {
    ids.push_back(static_cast<std::uint32_t>(marker.id));
    sides.push_back(marker.side_m);
    append_matrix(self.map().world_from_marker(marker), poses);
    submaps.push_back(self.map().submap_of(marker).value);
    is_surveyed.push_back(marker.surveyed_world_from_marker.has_value());
  }
  const auto count = static_cast<py::ssize_t>(ids.size());
  return {array_of(std::move(ids)),
          array_of(std::move(sides)),
          array_of(std::move(poses), {count, 4, 4}),
          array_of(std::move(submaps)),
          array_of(std::move(is_surveyed))};
}

MarkerObservationTable marker_observations(const PythonMap& self) {
  std::vector<std::uint32_t> keyframes, ids;
  std::vector<std::uint8_t> cameras;
  std::vector<float> pixels;
  self.map().keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (!keyframe.markers) return;
    for (const MarkerObservation& observation : *keyframe.markers) {
      keyframes.push_back(id.value);
      ids.push_back(static_cast<std::uint32_t>(observation.id));
      cameras.push_back(observation.camera);
      for (const Eigen::Vector2f& pixel : observation.pixels) {
        pixels.insert(pixels.end(), pixel.begin(), pixel.end());
      }
    }
  });
  const auto count = static_cast<py::ssize_t>(ids.size());
  return {array_of(std::move(keyframes)),
          array_of(std::move(ids)),
          array_of(std::move(cameras)),
          array_of(std::move(pixels), {count, 4, 2})};
}

py::array covisibility(const PythonMap& self) {
  std::vector<std::uint32_t> edges;
  self.map().covisibility().for_each([&](KeyframeId id, const Covisibility& covisible) {
    for (const CovisibilityEdge& edge : covisible.edges) {
      if (edge.keyframe < id) continue;
      edges.insert(edges.end(), {id.value, edge.keyframe.value, edge.num_shared});
    }
  });
  const auto count = static_cast<py::ssize_t>(edges.size() / 3);
  return array_of(std::move(edges), {count, 3});
}

using Color = std::array<std::uint8_t, 3>;

/// As the images of the keyframes show them; grey where fewer than two do.
std::vector<std::uint8_t> find_colors(const StoredMap& stored) {
  std::unordered_map<std::uint32_t, Color> by_landmark;  // For looking up only.
  for (const SubmapId submap : submaps_by_size(*stored.map)) {
    for (const ExportPoint& point : make_export_scene(*stored.map, submap, stored.images).points) {
      by_landmark[point.landmark.value] = point.color;
    }
  }
  std::vector<std::uint8_t> colors;
  stored.map->landmarks().for_each([&](LandmarkId id, const Landmark&) {
    const auto found = by_landmark.find(id.value);
    const Color color = found == by_landmark.end() ? Color{128, 128, 128} : found->second;
    colors.insert(colors.end(), color.begin(), color.end());
  });
  return colors;
}

std::optional<py::array> landmark_colors(const PythonMap& self) {
  if (self.stored.images.empty()) return std::nullopt;
  std::vector<std::uint8_t> colors;
  {
    const ReleasedGil released;
    colors = find_colors(self.stored);
  }
  const auto count = static_cast<py::ssize_t>(colors.size() / 3);
  return array_of(std::move(colors), {count, 3});
}

void bind_keyframes(py::module_& module) {
  Class<KeyframeTable>(
      module, "Keyframes", "All keyframes of a map, by id, as arrays of the same length K.")
      .def("__len__", [](const KeyframeTable& self) { return self.ids.size(); })
      .get("ids", "uint32 array (K,): ascending.", &KeyframeTable::ids)
      .get("frames", "uint32 array (K,): Keyframe.frame.", &KeyframeTable::frames)
      .get("timestamps_ns", "int64 array (K,): nanoseconds, as fed.", &KeyframeTable::timestamps_ns)
      .get("world_from_rig", "float64 array (K, 4, 4).", &KeyframeTable::world_from_rig)
      .get("submaps", "uint32 array (K,): whose frame the pose is in.", &KeyframeTable::submaps)
      .get("parents",
           "uint32 array (K,): in the spanning tree; NO_ID for the root of a sub-map.",
           &KeyframeTable::parents);
}

void bind_landmarks(py::module_& module) {
  Class<LandmarkTable>(
      module, "Landmarks", "All landmarks of a map, by id, as arrays of the same length M.")
      .def("__len__", [](const LandmarkTable& self) { return self.ids.size(); })
      .get("ids", "uint32 array (M,): ascending.", &LandmarkTable::ids)
      .get("positions_in_world",
           "float64 array (M, 3): metres (map units for one camera).",
           &LandmarkTable::positions_in_world)
      .get("submaps", "uint32 array (M,): whose frame the position is in.", &LandmarkTable::submaps)
      .get("num_observers",
           "uint32 array (M,): keyframes that see it.",
           &LandmarkTable::num_observers)
      .get("num_visible",
           "uint32 array (M,): frames in which it should have been seen.",
           &LandmarkTable::num_visible)
      .get("num_found", "uint32 array (M,): frames in which it was.", &LandmarkTable::num_found);
}

void bind_markers(py::module_& module) {
  Class<MarkerTable>(
      module, "Markers", "All markers that are known in a map, as arrays of the same length N.")
      .def("__len__", [](const MarkerTable& self) { return self.ids.size(); })
      .get("ids", "uint32 array (N,): numbers within the family.", &MarkerTable::ids)
      .get("sides_m", "float64 array (N,): of the black squares.", &MarkerTable::sides_m)
      .get("world_from_marker",
           "float64 array (N, 4, 4): the middle is the origin, x right, y up, z out of the print.",
           &MarkerTable::world_from_marker)
      .get("submaps", "uint32 array (N,): whose frame the pose is in.", &MarkerTable::submaps)
      .get("is_surveyed",
           "uint8 array (N,): 1 where it was said to be there and holds the map.",
           &MarkerTable::is_surveyed);
  Class<MarkerObservationTable>(module,
                                "MarkerObservations",
                                "What keyframes see of markers, as arrays of the same length N.")
      .def("__len__", [](const MarkerObservationTable& self) { return self.ids.size(); })
      .get("keyframes", "uint32 array (N,): ids, ascending.", &MarkerObservationTable::keyframes)
      .get("ids", "uint32 array (N,): numbers of the markers.", &MarkerObservationTable::ids)
      .get("cameras", "uint8 array (N,): index in the rig.", &MarkerObservationTable::cameras)
      .get("pixels",
           "float32 array (N, 4, 2): corners, top left, top right, bottom right, bottom left of "
           "the upright print.",
           &MarkerObservationTable::pixels);
}

}  // namespace

void bind_map_tables(Class<PythonMap, std::shared_ptr<PythonMap>>& map, py::module_& module) {
  bind_keyframes(module);
  bind_landmarks(module);
  bind_markers(module);
  map.def("keyframes", &keyframes, "keyframes(self)\n--\n\nAll keyframes: Keyframes (copies).")
      .def("landmarks", &landmarks, "landmarks(self)\n--\n\nAll landmarks: Landmarks (copies).")
      .def("markers", &markers, "markers(self)\n--\n\nMarkers that are known: Markers (copies).")
      .def("marker_observations", &marker_observations, R"(marker_observations(self)
--

Markers as the keyframes see them, known or not: MarkerObservations (copies).)")
      .def("covisibility", &covisibility, R"(covisibility(self)
--

uint32 array (E, 3): pairs of keyframes, the smaller id first, and how many landmarks they share.)")
      .def("landmark_colors", &landmark_colors, R"(landmark_colors(self)
--

uint8 array (M, 3): red, green, blue of each landmark of landmarks(), as the images of the keyframes
show it, grey (128) where fewer than two do; None for a map without images.)");
}

}  // namespace waymark::python
