// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/map/map.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/base/text.h"
#include "waymark/input/decode.h"
#include "waymark/mapfile/map_file.h"

namespace waymark::python {
namespace {

/// A keyframe of a map, which it keeps.
struct PythonKeyframe {
  std::shared_ptr<const Map> map;
  KeyframeId id;
  const Keyframe& get() const { return map->keyframes().at(id); }
};

struct PythonLandmark {
  std::shared_ptr<const Map> map;
  LandmarkId id;
  const Landmark& get() const { return map->landmarks().at(id); }
};

struct PythonSubmap {
  std::uint32_t id;
  Submap submap;
};

/// The id of something that is there, or KeyError.
template <class Key, class Table>
Key find_id(const Table& table, const char* name, const py::object& argument) {
  const std::int64_t value = integer_argument("id", argument);
  const bool fits = value >= 0 && value < UINT32_MAX;
  if (!fits || !table.contains(Key{static_cast<std::uint32_t>(value)})) {
    throw py::key_error(std::string(name) + " " + std::to_string(value) + " is not in the map");
  }
  return Key{static_cast<std::uint32_t>(value)};
}

KeyframeId keyframe_id(const PythonMap& self, const py::object& id) {
  return find_id<KeyframeId>(self.map().keyframes(), "keyframe", id);
}

py::array observations(const PythonLandmark& self) {
  const auto& values = self.get().observations;
  static_assert(sizeof(Observation) == 2 * sizeof(std::uint32_t));
  const std::uint32_t* first = values.empty() ? nullptr : &values.front().keyframe.value;
  return view_of(first, {static_cast<py::ssize_t>(values.size()), 2}, self.map);
}

py::tuple covisible(const PythonMap& self, const py::object& id) {
  std::vector<std::uint32_t> keyframes, counts;
  for (const CovisibilityEdge& edge : self.map().covisible(keyframe_id(self, id))) {
    keyframes.push_back(edge.keyframe.value);
    counts.push_back(edge.num_shared);
  }
  return py::make_tuple(array_of(std::move(keyframes)), array_of(std::move(counts)));
}

std::vector<PythonSubmap> submaps(const PythonMap& self) {
  std::vector<PythonSubmap> result;
  for (const Submap& submap : self.map().submaps()) {
    result.push_back({static_cast<std::uint32_t>(result.size()), submap});
  }
  return result;
}

std::optional<py::bytes> image(const PythonMap& self, const py::object& id) {
  const auto found = self.stored.images.find(keyframe_id(self, id));
  if (found == self.stored.images.end()) return std::nullopt;
  return py::bytes(*found->second);
}

SharedJpeg jpeg_argument(py::handle image) {
  if (py::isinstance<py::bytes>(image)) {
    auto bytes = std::make_shared<const std::string>(py::cast<std::string>(image));
    if (!bytes->starts_with("\xff\xd8") || !decode_color_image(*bytes)) {
      throw py::value_error("images: bytes of something else, expected those of a JPEG file");
    }
    return bytes;
  }
  return std::make_shared<const std::string>(encode_jpeg(color_argument("images", image)));
}

std::shared_ptr<PythonMap> with_images(const PythonMap& self, const py::dict& images) {
  auto result = std::make_shared<PythonMap>(self);
  for (const auto& [id, image] : images) {
    const KeyframeId keyframe = keyframe_id(self, py::reinterpret_borrow<py::object>(id));
    result->stored.images[keyframe] = jpeg_argument(image);
  }
  return result;
}

std::shared_ptr<PythonMap> load(const py::object& path) {
  const std::filesystem::path file = path_argument("path", path);
  const ReleasedGil released;
  return std::make_shared<PythonMap>(PythonMap{load_map(file)});
}

void save(const PythonMap& self, const py::object& path) {
  const std::filesystem::path file = path_argument("path", path);
  const ReleasedGil released;
  save_map(file, self.stored);
}

std::string describe_map(const PythonMap& self) {
  return "<Map of " + count_of(self.map().keyframes().size(), "keyframe") + ", " +
         count_of(self.map().landmarks().size(), "landmark") + ", " +
         (is_metric(self.map()) ? "in metres>" : "scale free>");
}

void bind_keyframe(py::module_& module) {
  Class<PythonKeyframe>(module, "Keyframe", "A frame that stays in the map.")
      .get("id", "int: never reused.", [](auto& self) { return self.id.value; })
      .get("frame",
           "int: unique in a map; a session that extends one counts on.",
           [](auto& self) { return self.get().frame.value; })
      .get("timestamp_ns",
           "int: nanoseconds, as fed.",
           [](auto& self) { return self.get().timestamp_ns; })
      .get("world_from_rig",
           "float64 array (4, 4).",
           [](auto& self) { return array_of(self.get().rig_from_world.inverse()); })
      .get("submap",
           "int: whose frame the pose is in.",
           [](auto& self) { return self.get().submap.value; })
      .get("parent",
           "int or None: in the spanning tree; None for the root of a sub-map.",
           [](auto& self) { return optional_id(self.get().parent); })
      .get("features",
           "Features: with the landmarks they show.",
           [](auto& self) {
             return PythonFeatures{self.get().features, self.map, &self.get().landmarks};
           })
      .get("cameras",
           "list of Camera: those that took it.",
           [](auto& self) { return self.get().rig().cameras; })
      .def("__repr__", [](const PythonKeyframe& self) {
        return "<Keyframe " + std::to_string(self.id.value) + " of " +
               count_of(self.get().features->size(), "feature") + ">";
      });
}

void bind_landmark(py::module_& module) {
  Class<PythonLandmark>(module, "Landmark", "A point of the map.")
      .get("id", "int: never reused.", [](auto& self) { return self.id.value; })
      .get("submap",
           "int: whose frame the position is in.",
           [](auto& self) { return self.get().submap.value; })
      .get("position_in_world",
           "float64 array (3,): metres (map units for one camera).",
           [](auto& self) {
             const Eigen::Vector3d& position = self.get().position_in_world;
             return array_of(std::vector<double>(position.begin(), position.end()));
           })
      .get("observations",
           "uint32 array (N, 2): id of a keyframe and index of the feature in it, ascending; a "
           "view without a copy.",
           &observations)
      .get("num_visible",
           "int: frames in which it should have been seen.",
           [](auto& self) { return self.get().num_visible; })
      .get("num_found",
           "int: frames in which it was.",
           [](auto& self) { return self.get().num_found; })
      .def("__repr__", [](const PythonLandmark& self) {
        return "<Landmark " + std::to_string(self.id.value) + " of " +
               count_of(self.get().observations.size(), "observation") + ">";
      });
}

void bind_parts(py::module_& module) {
  Class<PythonSubmap>(module, "Submap", "A connected part of a map with its own frame.")
      .get("id", "int.", &PythonSubmap::id)
      .get("is_metric",
           "bool: False where the scale is free.",
           [](auto& self) { return self.submap.is_metric; })
      .get("root",
           "int or None: its first keyframe; None once joined.",
           [](auto& self) { return optional_id(self.submap.root); })
      .get("joined_into",
           "int or None: the sub-map that it is a part of now.",
           [](auto& self) { return optional_id(self.submap.joined_into); })
      .def("__repr__", [](const PythonSubmap& self) {
        const SubmapId target = self.submap.joined_into;
        return "<Submap " + std::to_string(self.id) +
               (target.is_valid()
                    ? ", joined into " + std::to_string(target.value)
                    : std::string(self.submap.is_metric ? ", in metres" : ", scale free")) +
               ">";
      });
  Class<LoopEdge>(module, "LoopEdge", "Two keyframes that were found to show the same place.")
      .get("from_keyframe", "int.", [](auto& self) { return self.from.value; })
      .get("to_keyframe", "int.", [](auto& self) { return self.to.value; })
      .get("to_from_from",
           "float64 array (4, 4): rotation and translation between the rigs, as measured.",
           [](auto& self) {
             return array_of(Rigid3(self.to_from_from.rotation, self.to_from_from.translation));
           })
      .get("scale",
           "float: lengths around to_keyframe by those around from_keyframe; 1 in metres.",
           [](auto& self) { return self.to_from_from.scale; })
      .def("__repr__", [](const LoopEdge& self) {
        return "<LoopEdge from keyframe " + std::to_string(self.from.value) + " to " +
               std::to_string(self.to.value) + ">";
      });
}

using MapClass = Class<PythonMap, std::shared_ptr<PythonMap>>;

void bind_whole(MapClass& map) {
  map.def_static("load", &load, py::arg("path"), R"(load(path)
--

Reads a map file (.wmap) of any version. InputError for one that is missing or damaged.)");
  map.def("save", &save, py::arg("path"), R"(save(self, path)
--

Writes a map file, whole or not at all. OutputError when that fails.)")
      .get("is_metric",
           "bool: whether all sub-maps have a scale in metres.",
           [](auto& self) { return is_metric(self.map()); })
      .get("num_keyframes", "int.", [](auto& self) { return self.map().keyframes().size(); })
      .get("num_landmarks", "int.", [](auto& self) { return self.map().landmarks().size(); })
      .get("settings", "str: those used, as YAML.", [](auto& self) {
        return text_of(self.stored.settings);
      });
}

void bind_access(MapClass& map) {
  map.def("submaps", &submaps, "submaps(self)\n--\n\nlist of Submap, by id; joined ones, too.")
      .def(
          "keyframe",
          [](const PythonMap& self, const py::object& id) {
            return PythonKeyframe{self.stored.map, keyframe_id(self, id)};
          },
          py::arg("id"),
          "keyframe(self, id)\n--\n\nThe Keyframe of an id. KeyError where there is none.")
      .def(
          "landmark",
          [](const PythonMap& self, const py::object& id) {
            return PythonLandmark{self.stored.map,
                                  find_id<LandmarkId>(self.map().landmarks(), "landmark", id)};
          },
          py::arg("id"),
          "landmark(self, id)\n--\n\nThe Landmark of an id. KeyError where there is none.")
      .def("covisible", &covisible, py::arg("keyframe_id"), R"(covisible(self, keyframe_id)
--

The keyframes that share landmarks with one, and how many: two uint32 arrays (N,), by id.)")
      .def(
          "loop_edges",
          [](const PythonMap& self) { return self.map().loop_edges(); },
          "loop_edges(self)\n--\n\nPlaces seen again, in the order found: list of LoopEdge.")
      .def("image", &image, py::arg("keyframe_id"), R"(image(self, keyframe_id)
--

The image of a keyframe as the bytes of a JPEG file, or None: of maps made with --keep-images or with_images().)")
      .def("with_images", &with_images, py::arg("images"), R"(with_images(self, images)
--

The same map with images of keyframes, for exports and colours: a Map.

images: dict of keyframe ids to images of camera 0, each the bytes of a JPEG file or a uint8 array
    (H, W), or (H, W, 3) in the order red, green, blue, which becomes a JPEG file.)")
      .def("__repr__", &describe_map);
}

}  // namespace

void bind_map(py::module_& module) {
  bind_keyframe(module);
  bind_landmark(module);
  bind_parts(module);
  MapClass map(module, "Map", R"(A map as it was at one moment; it never changes.

Free to be read by any number of threads. Its frame is that of the first keyframe of a sub-map.)");
  bind_whole(map);
  bind_access(map);
  bind_map_tables(map, module);
  bind_map_tasks(map, module);
}

}  // namespace waymark::python
