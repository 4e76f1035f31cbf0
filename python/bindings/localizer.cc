// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/localizer.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <utility>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"

namespace waymark::python {
namespace {

/// A Localizer with what the arguments of Python need to be understood.
class PythonLocalizer {
 public:
  PythonLocalizer(SessionConfig config, std::shared_ptr<PythonMap> map)
      : config_(std::move(config)),
        map_(std::move(map)),
        localizer_(config_.rig, config_.settings, map_->stored.map) {}

  const std::shared_ptr<PythonMap>& map() const { return map_; }

  TrackingResult track(const py::object& timestamp_ns, const ImageArguments& images) {
    const Turn turn(is_taken_, "Localizer");
    const FrameArguments frame(images, config_.setup, config_.settings.depth);
    const FrameImages input = frame.input(integer_argument("timestamp_ns", timestamp_ns));
    const ReleasedGil released;
    return localizer_.track(input);
  }

  TrackingResult locate(const ImageArguments& images, const std::optional<PosePrior>& hint) {
    const Turn turn(is_taken_, "Localizer");
    const FrameArguments frame(images, config_.setup, config_.settings.depth);
    const ReleasedGil released;
    return localizer_.locate(frame.input(0), hint);
  }

  std::vector<CalibrationEstimate> calibration() {
    const Turn turn(is_taken_, "Localizer");
    return localizer_.calibration();
  }

 private:
  SessionConfig config_;
  std::shared_ptr<PythonMap> map_;
  Localizer localizer_;
  bool is_taken_ = false;
};

std::optional<PosePrior> hint_argument(const PythonMap& map,
                                       const py::object& world_from_rig,
                                       const py::object& submap) {
  if (world_from_rig.is_none()) return std::nullopt;
  PosePrior hint;
  hint.world_from_rig = pose_argument("hint", world_from_rig);
  const std::int64_t id = integer_argument("submap", submap);
  if (id < 0 || id >= static_cast<std::int64_t>(map.map().submaps().size())) {
    throw py::value_error("submap: is " + std::to_string(id) +
                          ", expected the id of one in the map");
  }
  hint.submap = map.map().resolve(SubmapId{static_cast<std::uint32_t>(id)});
  return hint;
}

using LocalizerClass = ThreadedClass<PythonLocalizer>;

void bind_locate(LocalizerClass& localizer) {
  localizer.def(
      "locate",
      [](PythonLocalizer& self,
         const py::object& image0,
         const py::object& image1,
         const py::object& depth,
         const py::object& mask,
         const py::object& hint,
         const py::object& submap) {
        return self.locate({image0, image1, depth, mask}, hint_argument(*self.map(), hint, submap));
      },
      py::arg("image0"),
      py::arg("image1") = py::none(),
      py::arg("depth") = py::none(),
      py::arg("mask") = py::none(),
      py::kw_only(),
      py::arg("hint") = py::none(),
      py::arg("submap") = 0,
      R"(locate(self, image0, image1=None, depth=None, mask=None, *, hint=None, submap=0)
--

Finds an image by itself and returns a TrackingResult, which without a pose says how far the search
got. The stream of track() is left alone. Images as in System.feed().

hint: about where it was taken, world_from_rig as an array (4, 4); looked for there first, and
    anywhere where it is not.
submap: whose frame the hint is in.)");
}

void bind_track(LocalizerClass& localizer) {
  localizer.def(
      "track",
      [](PythonLocalizer& self,
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

Finds the next image of a stream, near the one before, and anywhere where it is not; returns a
TrackingResult. Where the map shows too little, for two seconds at most, landmarks that the stream
itself saw make up for it. Arguments and errors as in System.feed().)");
}

}  // namespace

void bind_localizer(py::module_& module) {
  LocalizerClass localizer(module, "Localizer", R"(Finds images in a map that stays as it is.

The camera may be of another model, size and lens than those the map was made with. Poses are in the
map's frame. One thread at a time; a second one gets a RuntimeError.)");
  localizer.def(py::init([](std::shared_ptr<PythonMap> map,
                            const py::object& cameras,
                            const py::object& setup,
                            const py::object& settings,
                            const py::object& seed) {
                  SessionConfig config = read_session_config({cameras, setup, settings, seed});
                  const ReleasedGil released;
                  return make_of_one_process<PythonLocalizer>(std::move(config), std::move(map));
                }),
                py::arg("map").none(false),
                py::arg("cameras"),
                py::kw_only(),
                py::arg("setup") = py::none(),
                py::arg("settings") = py::none(),
                py::arg("seed") = py::none(),
                R"(__init__(self, map, cameras, *, setup=None, settings=None, seed=None)
--

map: a Map. The rest as for System. Ranges of stereo and depth count only in maps in metres.)");
  bind_locate(localizer);
  bind_track(localizer);
  localizer.def("calibration", &PythonLocalizer::calibration, R"(calibration(self)
--

What the images located so far told of each number of their calibration, which later ones are
located with: a list of CalibrationEstimate, empty as long as they did not contradict it.)");
  localizer.get("map", "Map: the one given.", &PythonLocalizer::map);
}

}  // namespace waymark::python
