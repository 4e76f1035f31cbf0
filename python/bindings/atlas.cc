// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "atlas.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/atlas/add.h"
#include "waymark/atlas/atlas_localizer.h"
#include "waymark/atlas/export_atlas.h"
#include "waymark/atlas/optimize_atlas.h"

namespace waymark::python {
namespace {

std::size_t tile_size_argument(const py::object& keyframes) {
  const std::int64_t number = integer_argument("keyframes", keyframes);
  if (number < static_cast<std::int64_t>(kMinKeyframesPerTile) ||
      number > static_cast<std::int64_t>(kMaxKeyframesPerTile)) {
    throw py::value_error("keyframes: is " + std::to_string(number) + ", expected 8 to 2048");
  }
  return static_cast<std::size_t>(number);
}

/// Adds maps; gives what was done as a dict.
py::dict add(Atlas& self, const py::object& maps, const py::object& keyframes, std::uint64_t seed) {
  std::vector<std::filesystem::path> paths;
  for (const py::handle map : py::iter(maps)) {
    paths.push_back(path_argument("maps", py::reinterpret_borrow<py::object>(map)));
  }
  const std::size_t size = tile_size_argument(keyframes);
  AddedMaps added;
  {
    const ReleasedGil released;
    added = add_maps(self, paths, size, seed);
  }
  py::dict result;
  result["num_added"] = added.num_added;
  result["num_tiles"] = added.num_tiles;
  result["num_pairs"] = added.num_pairs;
  result["num_links"] = added.num_links;
  return result;
}

/// An AtlasLocalizer with what the arguments of Python need to be understood.
class PythonAtlasLocalizer {
 public:
  PythonAtlasLocalizer(const Atlas& atlas, SessionConfig config, std::size_t max_open_tiles)
      : config_(std::move(config)),
        localizer_(config_.rig, config_.settings, atlas, max_open_tiles) {}

  TrackingResult track(const py::object& timestamp_ns, const ImageArguments& images) {
    const Turn turn(is_taken_, "AtlasLocalizer");
    const FrameArguments frame(images, config_.setup, config_.settings.depth);
    const FrameImages input = frame.input(integer_argument("timestamp_ns", timestamp_ns));
    const ReleasedGil released;
    return localizer_.track(input);
  }

  TrackingResult locate(const ImageArguments& images) {
    const Turn turn(is_taken_, "AtlasLocalizer");
    const FrameArguments frame(images, config_.setup, config_.settings.depth);
    const ReleasedGil released;
    return localizer_.locate(frame.input(0));
  }

  std::size_t num_opened() const { return localizer_.num_opened(); }

 private:
  SessionConfig config_;
  AtlasLocalizer localizer_;
  bool is_taken_ = false;
};

using AtlasClass = Class<Atlas, std::shared_ptr<Atlas>>;

void bind_atlas_outputs(AtlasClass& atlas) {
  atlas.def(
      "optimize",
      [](Atlas& self) {
        const ReleasedGil released;
        return optimize_atlas(self).num_adjusted;
      },
      R"(optimize(self)
--

Puts the tiles where all links say, and adjusts each among its neighbours. Gives how many were.)");
  atlas.def(
      "export",
      [](const Atlas& self) {
        const ReleasedGil released;
        return std::make_shared<PythonMap>(PythonMap{export_atlas(self)});
      },
      R"(export(self)
--

All of it as one Map.)");
  atlas.def(
      "check",
      [](const Atlas& self) {
        py::list faults;
        for (const std::string& fault : find_atlas_faults(self.folder())) {
          faults.append(text_of(fault));
        }
        return faults;
      },
      R"(check(self)
--

Everything that is wrong with its files: a list of str.)");
}

void bind_atlas_class(py::module_& module) {
  AtlasClass atlas(module, "Atlas", R"(One map of many recordings: a folder of tiles.

See docs/atlas-format.md. Reading a damaged one is an InputError.)");
  atlas.def(
      py::init([](const py::object& folder) {
        return std::make_shared<Atlas>(Atlas::open_or_create(path_argument("folder", folder)));
      }),
      py::arg("folder"),
      R"(__init__(self, folder)
--

Opens an atlas, or makes an empty one where there is nothing.)");
  atlas.def("add",
            &add,
            py::arg("maps"),
            py::kw_only(),
            py::arg("keyframes") = 128,
            py::arg("seed") = 0,
            R"(add(self, maps, *, keyframes=128, seed=0)
--

Cuts map files (a list of paths) into tiles of at most so many keyframes, finds what they share with
the tiles there and with each other, and puts them in place. Gives a dict of num_added, num_tiles,
num_pairs (tiles that were compared) and num_links (places of one map that another shows).)");
  bind_atlas_outputs(atlas);
  atlas.def_property_readonly("folder", &Atlas::folder, "pathlib.Path: where it is.");
  const auto part = [&](const char* name, const char* about) {
    atlas.def_property_readonly(
        name,
        [name](const Atlas& self) { return py::object(describe_contents(self.contents())[name]); },
        about);
  };
  part("recordings", "list of dict: checksum, name, since.");
  part("tiles",
       "list of dict: what each tile is and where it lies (anchor: qx qy qz qw tx ty tz scale).");
  part("links", "list of dict: a, b (indices of tiles), is_border, num_shared, b_from_a.");
}

void bind_finding(ThreadedClass<PythonAtlasLocalizer>& localizer) {
  localizer.def(
      "locate",
      [](PythonAtlasLocalizer& self,
         const py::object& image0,
         const py::object& image1,
         const py::object& depth,
         const py::object& mask) {
        return self.locate({image0, image1, depth, mask});
      },
      py::arg("image0"),
      py::arg("image1") = py::none(),
      py::arg("depth") = py::none(),
      py::arg("mask") = py::none(),
      R"(locate(self, image0, image1=None, depth=None, mask=None)
--

Finds an image by itself and returns a TrackingResult.)");
  localizer.def(
      "track",
      [](PythonAtlasLocalizer& self,
         const py::object& timestamp_ns,
         const py::object& image0,
         const py::object& image1,
         const py::object& depth,
         const py::object& mask) {
        return self.track(timestamp_ns, {image0, image1, depth, mask});
      },
      py::arg("timestamp_ns"),
      py::arg("image0"),
      py::arg("image1") = py::none(),
      py::arg("depth") = py::none(),
      py::arg("mask") = py::none(),
      R"(track(self, timestamp_ns, image0, image1=None, depth=None, mask=None)
--

Finds the next image of a stream and returns a TrackingResult.)");
}

void bind_atlas_localizer(py::module_& module) {
  ThreadedClass<PythonAtlasLocalizer> localizer(
      module, "AtlasLocalizer", R"(Finds images in an Atlas, of which it opens the tiles it needs.

Poses are in the frame of the part of the atlas that the result's submap names.)");
  localizer.def(
      py::init([](const Atlas& atlas,
                  const py::object& cameras,
                  const py::object& setup,
                  const py::object& settings,
                  const py::object& seed,
                  std::size_t max_open_tiles) {
        SessionConfig config = read_session_config({cameras, setup, settings, seed});
        const ReleasedGil released;
        return make_of_one_process<PythonAtlasLocalizer>(atlas, std::move(config), max_open_tiles);
      }),
      py::arg("atlas"),
      py::arg("cameras"),
      py::kw_only(),
      py::arg("setup") = py::none(),
      py::arg("settings") = py::none(),
      py::arg("seed") = py::none(),
      py::arg("max_open_tiles") = kMaxOpenTiles,
      R"(__init__(self, atlas, cameras, *, setup=None, settings=None, seed=None, max_open_tiles=16)
--

atlas: an Atlas. max_open_tiles: how many stay in memory. The rest as for Localizer.)");
  bind_finding(localizer);
  localizer.get("num_opened", "int: how often a tile was read.", &PythonAtlasLocalizer::num_opened);
}

}  // namespace

void bind_atlas(py::module_& module) {
  bind_atlas_class(module);
  bind_atlas_localizer(module);
}

}  // namespace waymark::python
