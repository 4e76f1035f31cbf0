// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What the program does with saved maps: join, scale and level, write for others, show.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "pictures.h"
#include "texts.h"
#include "viewer.h"
#include "waymark/base/text.h"
#include "waymark/exchange/align_map.h"
#include "waymark/exchange/export_map.h"
#include "waymark/exchange/export_split.h"
#include "waymark/input/input_report.h"
#include "waymark/session/merging.h"

namespace waymark::python {
namespace {

using MapClass = Class<PythonMap, std::shared_ptr<PythonMap>>;

/// Two maps in one, and what became of them.
struct PythonMergedMap {
  std::shared_ptr<PythonMap> map;
  int num_joins = 0;
  int num_loops = 0;
  bool is_incomparable = false;
};

PythonMergedMap merge(const PythonMap& self, const PythonMap& other, const py::object& seed) {
  const std::int64_t number = integer_argument("seed", seed);
  if (number < 0) throw py::value_error("seed: is negative, expected 0 or more");
  const ReleasedGil released;
  MergedStored merged = merge_stored(self.stored, other.stored, static_cast<std::uint64_t>(number));
  return {std::make_shared<PythonMap>(PythonMap{std::move(merged.stored)}),
          merged.num_joins,
          merged.num_loops,
          merged.is_incomparable};
}

/// Of a Trajectory, or a file.
std::vector<StampedPose> trajectory_argument(const py::object& trajectory, std::string& name) {
  std::vector<StampedPose> poses;
  if (py::isinstance<Trajectory>(trajectory)) {
    name = "trajectory";
    for (const TrajectoryFrame& frame : trajectory.cast<const Trajectory&>().frames) {
      poses.push_back({frame.timestamp_ns, frame.world_from_rig});
    }
    return poses;
  }
  const std::filesystem::path path = path_argument("trajectory", trajectory);
  name = path.string();
  return read_trajectory(path);
}

std::vector<KnownDistance> distances_argument(const py::object& distances) {
  constexpr const char* kExpected = "a list of (keyframe id, keyframe id, metres)";
  std::vector<KnownDistance> known;
  if (!py::isinstance<py::sequence>(distances)) fail_type("distances", distances, kExpected);
  for (const py::handle item : distances) {
    if (!py::isinstance<py::sequence>(item) || py::len(item) != 3) {
      fail_type("distances", item, kExpected);
    }
    const auto triple = py::reinterpret_borrow<py::sequence>(item);
    std::uint32_t ids[2];
    for (std::size_t i = 0; i < 2; ++i) {
      const std::int64_t id = integer_argument("distances", py::object(triple[i]));
      if (id < 0 || id >= UINT32_MAX) {
        throw py::key_error("keyframe " + std::to_string(id) + " is not in the map");
      }
      ids[i] = static_cast<std::uint32_t>(id);
    }
    known.push_back({KeyframeId{ids[0]}, KeyframeId{ids[1]}, py::float_(triple[2])});
  }
  return known;
}

Eigen::Vector3d direction_argument(const py::object& up) {
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(up);
  if (!numbers || numbers.ndim() != 1 || numbers.shape(0) != 3) {
    PyErr_Clear();
    fail_type("up", up, "three numbers");
  }
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

std::shared_ptr<PythonMap> align(const PythonMap& self,
                                 const py::object& distances,
                                 const py::object& trajectory,
                                 const py::object& up) {
  if (!distances.is_none() + !trajectory.is_none() + !up.is_none() != 1) {
    throw py::type_error("align: expected one of distances, trajectory, up");
  }
  std::string name;
  AlignedMap aligned;
  if (!distances.is_none()) {
    aligned = align_to_distances(self.map(), distances_argument(distances), "distances");
  } else if (!trajectory.is_none()) {
    const std::vector<StampedPose> poses = trajectory_argument(trajectory, name);
    aligned = align_to_trajectory(self.map(), poses, name);
  } else {
    aligned = align_upright(self.map(), direction_argument(up), "up");
  }
  auto result = std::make_shared<PythonMap>(self);
  result->stored.map = aligned.map.freeze();
  return result;
}

ExportFormat format_argument(const std::string& name) {
  if (name == "ply") return ExportFormat::kPly;
  if (name == "colmap") return ExportFormat::kColmap;
  if (name == "nerfstudio") return ExportFormat::kNerfstudio;
  if (name == "tum") return ExportFormat::kTum;
  if (name == "kitti") return ExportFormat::kKitti;
  if (name == "markers") return ExportFormat::kMarkers;
  throw py::value_error("format: is " + quote_for_message(name) +
                        ", expected ply, colmap, nerfstudio, tum, kitti or markers");
}

ExportedFrames frames_argument(const py::object& frames) {
  constexpr const char* kExpected =
      "'keyframes', 'all', ('every', N) or ('sharpest', N) with N from 1 on";
  std::string name;
  std::int64_t number = 1;
  const bool is_pair = py::isinstance<py::tuple>(frames) && py::len(frames) == 2;
  const py::object first = is_pair ? py::object(frames.cast<py::tuple>()[0]) : frames;
  if (!py::isinstance<py::str>(first)) fail_type("frames", frames, kExpected);
  name = text_argument("frames", first);
  if (is_pair) number = integer_argument("frames", py::object(frames.cast<py::tuple>()[1]));
  ExportedFrames result;
  const bool has_number = name == "every" || name == "sharpest";
  if (name == "all") {
    result.choice = FrameChoice::kAll;
  } else if (has_number) {
    result.choice = name == "every" ? FrameChoice::kEvery : FrameChoice::kSharpest;
  } else if (name != "keyframes") {
    throw py::value_error("frames: is " + quote_for_message(name) + ", expected " + kExpected);
  }
  if (has_number != is_pair || number < 1) fail_value("frames", frames, kExpected);
  result.number = static_cast<std::size_t>(number);
  return result;
}

void export_to(const PythonMap& self,
               const py::object& path,
               const std::string& format,
               bool text,
               const py::object& split_views,
               bool undistort,
               const py::object& frames,
               const py::object& input,
               const py::object& trajectory) {
  MapExport what;
  what.out = path_argument("path", path);
  what.format = format_argument(format);
  what.is_text = text;
  what.is_undistorted = undistort;
  if (!split_views.is_none()) {
    const std::int64_t number = integer_argument("split_views", split_views);
    if (number < kMinSplitViews || number > kMaxSplitViews) {
      throw py::value_error("split_views: is " + std::to_string(number) + ", expected " +
                            std::to_string(kMinSplitViews) + " to " +
                            std::to_string(kMaxSplitViews));
    }
    what.split_views = static_cast<int>(number);
  }
  what.frames = frames_argument(frames);
  if (!input.is_none()) what.input = path_argument("input", input);
  if (!trajectory.is_none()) {
    what.trajectory = trajectory_argument(trajectory, what.trajectory_name);
  }
  const ReleasedGil released;
  export_map(self.stored, "the map", what);
}

py::object input_info(const py::object& path, const py::object& cameras, const py::object& setup) {
  InputOptions options;
  options.setup = setup_argument(setup);
  if (!cameras.is_none()) options.calibration = read_cameras(cameras);
  const std::filesystem::path file = path_argument("path", path);
  std::string json;
  {
    const ReleasedGil released;
    json = format_input_json(open_input(file, options)->info());
  }
  return py::module_::import("json").attr("loads")(text_of(json));
}

/// The largest sub-map; others have worlds of their own.
std::string picture_of(const PythonMap& self) {
  const Map& map = self.map();
  const std::vector<SubmapId> submaps = submaps_by_size(map);
  MapPicture picture;
  if (!submaps.empty()) {
    map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
      if (landmark.submap == submaps[0]) picture.points.push_back(landmark.position_in_world);
    });
    picture.ways.emplace_back();
    for (const FramePlace& place : keyframe_places(map, submaps[0])) {
      picture.ways.back().push_back(place.rig_from_world.inverse());
    }
  }
  return draw_html(picture,
                   count_of(map.keyframes().size(), "keyframe") + ", " +
                       count_of(map.landmarks().size(), "landmark") + ", " +
                       count_of(submaps.size(), "sub-map") + ", " +
                       (is_metric(map) ? "in metres" : "scale free"));
}

void bind_merged_map(py::module_& module) {
  Class<PythonMergedMap>(module, "MergedMap", "Two maps in one: what Map.merge() gives.")
      .get("map", "Map: both, in the frame of the first.", &PythonMergedMap::map)
      .get("num_joins",
           "int: sub-maps that were found to overlap and joined; 0: they lie side by side.",
           &PythonMergedMap::num_joins)
      .get("num_loops", "int: further places seen in both.", &PythonMergedMap::num_loops)
      .get("is_incomparable",
           "bool: one is in metres and the scale of the other is free, so that nothing was "
           "compared; align() makes it metres.",
           &PythonMergedMap::is_incomparable)
      .def("__repr__", [](const PythonMergedMap& self) {
        return "<MergedMap of " + count_of(self.map->map().keyframes().size(), "keyframe") + ", " +
               count_of(self.num_joins, "join") + ", " + count_of(self.num_loops, "loop") + ">";
      });
}

void bind_changes(MapClass& map) {
  map.def("merge",
          &merge,
          py::arg("other"),
          py::kw_only(),
          py::arg("seed") = 0,
          R"(merge(self, other, *, seed=0)
--

Puts two maps into one and joins what shows the same places: a MergedMap. Its frame is that of this
one.)")
      .def("align",
           &align,
           py::kw_only(),
           py::arg("distances") = py::none(),
           py::arg("trajectory") = py::none(),
           py::arg("up") = py::none(),
           R"(align(self, *, distances=None, trajectory=None, up=None)
--

The same map scaled, levelled, or put where a trajectory is: a Map. One of

distances: list of (keyframe id, keyframe id, metres): how far apart they are, for a map whose scale
    is free.
trajectory: poses of camera 0, a Trajectory or a file (TUM, EuRoC csv, KITTI).
up: three numbers, a direction in the largest sub-map that becomes +z.

InputError where that cannot be.)");
}

void bind_outputs(MapClass& map) {
  map.def(
         "export",
         &export_to,
         py::arg("path"),
         py::arg("format") = "ply",
         py::kw_only(),
         py::arg("text") = false,
         py::arg("split_views") = py::none(),
         py::arg("undistort") = false,
         py::arg("frames") = "keyframes",
         py::arg("input") = py::none(),
         py::arg("trajectory") = py::none(),
         R"(export(self, path, format='ply', *, text=False, split_views=None, undistort=False, frames='keyframes', input=None, trajectory=None)
--

Writes the map for other tools, as `waymark export` does.

path: a file for 'ply', 'tum' and 'kitti', a folder for 'colmap' and 'nerfstudio'; an earlier export
    there is replaced as a whole.
text: COLMAP's text form.
split_views: 360 degree and fisheye views become so many of 90 degrees each, 4 to 32.
undistort: images and cameras without distortion, for programs that know none.
frames: which become views: 'keyframes', 'all', ('every', N) or ('sharpest', N).
input: path of the recording that the map was made of; has the images of other frames, and of
    camera 1.
trajectory: of the run that made the map, a Trajectory or its file; for other frames than keyframes.

InputError for what does not go together; OutputError.)")
      .def(
          "view",
          [](const PythonMap& self, const py::object& address) {
            return std::shared_ptr<PythonViewer>(
                make_of_one_process<PythonViewer>(address_argument(address), self.stored));
          },
          py::arg("address") = "8080",
          R"(view(self, address='8080')
--

Shows the map in the browser, at a port of this machine (0: a free one) or 'HOST:PORT': a Viewer,
which has to be kept.)")
      .def("_repr_html_", &picture_of);
}

}  // namespace

void bind_map_tasks(Class<PythonMap, std::shared_ptr<PythonMap>>& map, py::module_& module) {
  bind_merged_map(module);
  bind_changes(map);
  bind_outputs(map);
  module.def("info",
             &input_info,
             py::arg("path"),
             py::arg("cameras") = py::none(),
             py::arg("setup") = py::none(),
             R"(info(path, cameras=None, setup=None)
--

What an input holds, as `waymark info --json` says it: a dict. Arguments are those of open_input().)");
}

}  // namespace waymark::python
