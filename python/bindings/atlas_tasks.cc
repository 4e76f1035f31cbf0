// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The steps that make an atlas, each a pure function of files in its folder: what waymark.fleet has
// done by many processes.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "atlas.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/atlas/add.h"
#include "waymark/atlas/adjust_tiles.h"
#include "waymark/atlas/anchors.h"
#include "waymark/atlas/atlas_places.h"
#include "waymark/atlas/steps.h"
#include "waymark/base/scratch_folder.h"
#include "waymark/base/text.h"

namespace waymark::python {
namespace {

/// [origin of a, origin of b, landmarks]
py::tuple describe(const NewShared& shared) {
  return py::make_tuple(shared.origin_a, shared.origin_b, describe_landmarks(shared.landmarks));
}

std::vector<NewShared> read_shared(const py::list& list) {
  std::vector<NewShared> shared;
  for (const py::handle one : list) {
    const auto row = py::reinterpret_borrow<py::sequence>(one);
    shared.push_back({row[0].cast<std::string>(),
                      row[1].cast<std::string>(),
                      read_landmarks(py::object(row[2]))});
  }
  return shared;
}

/// Of the links of contents, by their tiles.
ReadShared reader_of(const AtlasContents& contents, const std::vector<NewShared>& shared) {
  std::map<std::pair<std::string, std::string>, SharedLandmarks> by_origins;
  for (const NewShared& one : shared) by_origins[{one.origin_a, one.origin_b}] = one.landmarks;
  return [&contents, by_origins = std::move(by_origins)](const AtlasLink& link) {
    const auto at = by_origins.find({contents.tiles[link.a].origin, contents.tiles[link.b].origin});
    return at == by_origins.end() ? SharedLandmarks{} : at->second;
  };
}

Atlas atlas_in(const py::object& folder) {
  return Atlas::of_tiles(path_argument("folder", folder));
}

py::tuple cut(const py::object& folder,
              const py::object& map,
              const std::string& checksum,
              const std::string& name,
              std::size_t keyframes) {
  Atlas atlas = atlas_in(folder);
  const std::filesystem::path path = path_argument("map", map);
  CutRecording cut;
  {
    const ReleasedGil released;
    cut = cut_recording(atlas, load_map(path), checksum, name, keyframes);
  }
  py::list shared;
  for (const NewShared& one : cut.shared) shared.append(describe(one));
  return py::make_tuple(describe_contents(cut.contents), shared);
}

py::dict append(const py::list& all) {
  AtlasContents contents;
  for (const py::handle one : all) append_contents(contents, read_contents(one.cast<py::dict>()));
  return describe_contents(contents);
}

/// The places of a range of tiles, and what asks them.
struct PythonPlaces {
  Atlas atlas;
  AtlasContents contents;
  AtlasPlaces places;

  PythonPlaces(const py::object& folder,
               const py::dict& described,
               std::uint32_t begin,
               std::uint32_t end)
      : atlas(atlas_in(folder)),
        contents(read_contents(described)),
        places(atlas, contents, {begin, end}) {}

  /// Of a tile: [(tile, score, queries), ...]
  py::list alike(std::uint32_t tile) const {
    std::vector<AlikeTile> found;
    {
      const ReleasedGil released;
      const StoredMap stored = atlas.load_tile(contents.tiles.at(tile));
      found = find_alike_tiles(contents, places, tile, *stored.map, kMaxLinksSought);
    }
    py::list described;
    for (const AlikeTile& one : found) {
      py::list queries;
      for (const KeyframeId id : one.queries) queries.append(id.value);
      described.append(py::make_tuple(one.tile, one.score, queries));
    }
    return described;
  }
};

/// [(begin, end), ...]
py::list divide(const py::dict& described, std::size_t max_keyframes) {
  py::list ranges;
  for (const TileRange& range : divide_tiles(read_contents(described), max_keyframes)) {
    ranges.append(py::make_tuple(range.begin, range.end));
  }
  return ranges;
}

py::list pairs_of(const py::list& alike) {
  std::vector<std::pair<std::uint32_t, std::vector<AlikeTile>>> by_tile;
  for (const py::handle of_tile : alike) {
    const auto row = py::reinterpret_borrow<py::sequence>(of_tile);
    auto& [tile, others] = by_tile.emplace_back();
    tile = row[0].cast<std::uint32_t>();
    for (const py::handle one : py::object(row[1])) {
      const auto fields = py::reinterpret_borrow<py::sequence>(one);
      AlikeTile& other = others.emplace_back();
      other.tile = fields[0].cast<std::uint32_t>();
      other.score = fields[1].cast<double>();
      for (const std::uint32_t id : fields[2].cast<std::vector<std::uint32_t>>()) {
        other.queries.push_back(KeyframeId{id});
      }
    }
  }
  py::list pairs;
  for (const TilePair& pair : choose_pairs(by_tile)) {
    py::list queries;
    for (const KeyframeId id : pair.queries) queries.append(id.value);
    pairs.append(py::make_tuple(pair.a, pair.b, queries));
  }
  return pairs;
}

py::object match(const py::object& folder,
                 const py::dict& described,
                 std::uint32_t a,
                 std::uint32_t b,
                 const std::vector<std::uint32_t>& queries,
                 std::uint64_t seed) {
  const Atlas atlas = atlas_in(folder);
  const AtlasContents contents = read_contents(described);
  TilePair pair{a, b, {}};
  for (const std::uint32_t id : queries) pair.queries.push_back(KeyframeId{id});
  std::optional<FoundLink> found;
  {
    const ReleasedGil released;
    const StoredMap of_a = atlas.load_tile(contents.tiles.at(a));
    const StoredMap of_b = atlas.load_tile(contents.tiles.at(b));
    found = link_pair(contents, pair, *of_a.map, *of_b.map, seed);
  }
  if (!found) return py::none();
  return py::make_tuple(describe_link(found->link), describe(found->shared));
}

py::dict solve(const py::dict& described) {
  AtlasContents contents = read_contents(described);
  sort_contents(contents);
  solve_anchors(contents);
  return describe_contents(contents);
}

std::string adjust(const py::object& folder,
                   const py::dict& described,
                   std::uint32_t tile,
                   const py::list& shared) {
  Atlas atlas = atlas_in(folder);
  const AtlasContents contents = read_contents(described);
  const ReadShared reader = reader_of(contents, read_shared(shared));
  const ReleasedGil released;
  return adjust_stored_tile(atlas, contents, tile, reader);
}

std::array<double, 8> refit(const py::object& folder,
                            const py::dict& described,
                            std::size_t link,
                            const py::list& shared) {
  const Atlas atlas = atlas_in(folder);
  const AtlasContents contents = read_contents(described);
  const ReadShared reader = reader_of(contents, read_shared(shared));
  const ReleasedGil released;
  const AtlasLink& one = contents.links.at(link);
  return numbers_of(refit_link(atlas, contents, one, reader(one)));
}

/// Takes over files of tiles that the atlas lacks, and makes contents its state unless another
/// program has changed it, which is what it gives.
bool commit(Atlas& self, const py::dict& described, const py::list& shared, const py::list& files) {
  AtlasChange change{read_contents(described), read_shared(shared)};
  sort_contents(change.contents);
  std::vector<std::filesystem::path> paths;
  for (const py::handle file : files) {
    paths.push_back(path_argument("files", py::reinterpret_borrow<py::object>(file)));
  }
  const ReleasedGil released;
  for (const std::filesystem::path& path : paths) self.store_file(path);
  return self.commit(change);
}

/// A folder for what one process writes, with its lock, in a block of Python.
struct PythonScratchFolder {
  std::filesystem::path prefix;
  std::optional<ScratchFolder> folder;

  std::filesystem::path enter() { return folder.emplace(prefix).path(); }
};

void bind_scratch_folders(py::module_& module) {
  py::class_<PythonScratchFolder>(module, "_ScratchFolder")
      .def(py::init([](const py::object& prefix) {
        return std::make_unique<PythonScratchFolder>(path_argument("prefix", prefix));
      }))
      .def("__enter__", &PythonScratchFolder::enter)
      .def("__exit__", [](PythonScratchFolder& self, const py::args&) { self.folder.reset(); });
  module.def("_remove_abandoned_scratch", [](const py::object& prefix) {
    remove_abandoned_scratch(path_argument("prefix", prefix));
  });
}

}  // namespace

void bind_atlas_tasks(py::module_& module) {
  module.def("_cut", &cut);
  module.def("_append", &append);
  py::class_<PythonPlaces>(module, "_Places")
      .def(py::init<const py::object&, const py::dict&, std::uint32_t, std::uint32_t>())
      .def("alike", &PythonPlaces::alike);
  module.def("_divide", &divide);
  module.def("_pairs", &pairs_of);
  module.def("_match", &match);
  module.def("_solve", &solve);
  module.def("_schedule",
             [](const py::dict& contents) { return schedule_adjustment(read_contents(contents)); });
  module.def("_adjust", &adjust);
  module.def("_refit", &refit);
  module.def("_commit", &commit);
  module.def("_reload", &Atlas::reload);
  module.def("_shared", [](const Atlas& atlas, std::size_t link) {
    return describe_landmarks(atlas.read_shared(atlas.contents().links.at(link)));
  });
  module.def("_checksum_of_map",
             [](const py::object& path) { return checksum_of_map(path_argument("path", path)); });
  module.def("_printable", [](const py::bytes& text) {
    return text_of(printable(text.cast<std::string_view>()));
  });
  bind_scratch_folders(module);
}

}  // namespace waymark::python
