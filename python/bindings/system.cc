// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/system.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "texts.h"
#include "viewer.h"
#include "waymark/base/disk_memory.h"
#include "waymark/base/text.h"
#include "waymark/session/session.h"

namespace waymark::python {
namespace {

constexpr double kMaxMemoryGb = 1e6;

/// A System with what arguments need to be understood; what takes long lets other threads run.
class PythonSystem {
  auto ask(auto get) {
    const Turn turn = take();
    return (system_.*get)();
  }

 public:
  PythonSystem(SessionConfig config, Timing timing, std::shared_ptr<PythonMap> map);

  TrackingResult feed(const py::object& timestamp_ns, const ImageArguments& images) {
    const Turn turn = take();
    expect_unfinished("feed");
    const FrameArguments frame(images, config_.setup, config_.settings.depth);
    if (config_.setup == Setup::kRgbd && !frame.has_depth() && system_.frame_states().empty()) {
      fail_value("depth", images.depth, "the depth of the first frame in setup rgbd");
    }
    const FrameImages input = frame.input(integer_argument("timestamp_ns", timestamp_ns));
    TrackingResult result;
    {
      const ReleasedGil released;
      result = system_.feed(input);
    }
    if (viewer_) viewer_->tell(system_, input, result);
    result.features.reset();  // See FrameDetails.
    // The first frame decides.
    if (!config_.setup) config_.setup = frame.has_depth() ? Setup::kRgbd : Setup::kMono;
    return result;
  }

  void feed_imu(const py::object& timestamp_ns, const py::object& turns, const py::object& forces) {
    const Turn turn = take();
    expect_unfinished("feed_imu");
    for (const ImuSample& one : imu_samples(timestamp_ns, turns, forces)) system_.feed_imu(one);
  }

  std::optional<InertialReport> inertial() { return ask(&System::inertial); }
  std::vector<NavigationState> inertial_path() { return ask(&System::inertial_path); }
  SystemStatistics statistics() { return ask(&System::statistics); }
  std::vector<CalibrationEstimate> calibration() { return ask(&System::calibration); }

  void finish() {
    const Turn turn = take();
    {
      const ReleasedGil released;
      system_.finish();
    }
    is_finished_ = true;
    if (viewer_) viewer_->finish(system_);
  }

  void keep_map_in(const std::filesystem::path& folder, double max_memory_gb) {
    const Turn turn = take();
    if (is_finished_ || !system_.frame_states().empty()) {
      throw std::runtime_error("System: keep_map_in() after feed(), expected before");
    }
    // Also false for what is no number.
    if (!(max_memory_gb >= 0.0 && max_memory_gb <= kMaxMemoryGb)) {
      throw py::value_error("max_memory_gb: is " + std::string(py::str(py::float_(max_memory_gb))) +
                            ", expected 0 to 1e6");
    }
    system_.keep_map_in(
        std::make_shared<DiskMemory>(folder, static_cast<std::size_t>(max_memory_gb * 1e9)));
  }

  void reset() {
    const Turn turn = take();
    expect_unfinished("reset");
    {
      const ReleasedGil released;
      system_.reset();
    }
    images_.clear();
    if (viewer_) viewer_->reset();
  }

  void set_mapping(bool is_on) {
    const Turn turn = take();
    expect_unfinished("set_mapping");
    system_.set_mapping(is_on);
    if (viewer_) viewer_->set_mapping(is_on);
  }

  std::shared_ptr<PythonViewer> view(const ViewerOptions& address) {
    const Turn turn = take();
    expect_unfinished("view");
    const std::string setup = config_.setup ? std::string(to_string(*config_.setup)) : "mono";
    viewer_ = make_of_one_process<PythonViewer>(address, setup, std::string(to_string(timing_)));
    return viewer_;
  }

  std::shared_ptr<PythonMap> map() {
    const Turn turn = take();
    const std::shared_ptr<const Map> newest = system_.map();
    if (!last_map_ || last_map_->stored.map != newest) {
      last_map_ = std::make_shared<PythonMap>();
      last_map_->stored = {newest, settings_yaml_, images_, system_.inertial()};
    }
    return last_map_;
  }

  Trajectory trajectory() { return {ask(&System::trajectory)}; }

  std::vector<std::string> frame_states() {
    const Turn turn = take();
    std::vector<std::string> names;
    for (const FrameState state : system_.frame_states()) names.emplace_back(to_string(state));
    return names;
  }

  std::optional<py::array_t<std::uint8_t>> ego_mask() {
    const Turn turn = take();
    const Image mask = system_.ego_mask();
    if (mask.values.empty()) return std::nullopt;
    return py::array_t<std::uint8_t>(Shape{mask.height_px, mask.width_px}, mask.values.data());
  }

  FrameDetails details() {
    const Turn turn = take();
    const TrackingResult& result = system_.result();
    return {result.frame_in_map, result.features, result.landmarks};
  }

  void save(const std::filesystem::path& path) {
    const std::shared_ptr<PythonMap> newest = map();
    const ReleasedGil released;
    save_map(path, newest->stored);
  }

  bool is_finished() const { return is_finished_; }

 private:
  void expect_unfinished(const char* method) const {
    if (is_finished_) {
      throw std::runtime_error(std::string("System: ") + method +
                               "() after finish(), expected before");
    }
  }

  Turn take() { return Turn(is_taken_, "System", process_); }

  SessionConfig config_;
  const Timing timing_;
  const std::string settings_yaml_;
  System system_;
  KeyframeImages images_;  // Of the map to go on in.
  std::shared_ptr<PythonMap> last_map_;
  std::shared_ptr<PythonViewer> viewer_;
  bool is_finished_ = false;
  bool is_taken_ = false;
  const pid_t process_ = ::getpid();
};

PythonSystem::PythonSystem(SessionConfig config, Timing timing, std::shared_ptr<PythonMap> map)
    : config_(std::move(config)),
      timing_(timing),
      settings_yaml_(settings_as_yaml(config_.settings)),
      system_(config_.rig, config_.settings, timing, map ? map->stored.map : nullptr) {
  if (map) images_ = map->stored.images;
}

OfOneProcess<PythonSystem> make_system(const py::object& cameras,
                                       const py::object& setup,
                                       const std::string& timing,
                                       const py::object& settings,
                                       const py::object& seed,
                                       std::shared_ptr<PythonMap> map) {
  SessionConfig config = read_session_config({cameras, setup, settings, seed});
  const Timing mode = timing_argument(timing);
  const ReleasedGil released;
  return make_of_one_process<PythonSystem>(std::move(config), mode, std::move(map));
}

using SystemClass = ThreadedClass<PythonSystem>;

void bind_feed(SystemClass& system) {
  system.def(
      "feed",
      [](PythonSystem& self,
         const py::object& timestamp_ns,
         const py::object& image0,
         const py::object& image1,
         const py::object& depth,
         const py::object& mask) {
        return self.feed(timestamp_ns, {image0, image1, depth, mask});
      },
      py::arg("timestamp_ns"),
      py::arg("image0"),
      py::arg("image1") = py::none(),
      py::arg("depth") = py::none(),
      py::arg("mask") = py::none(),
      R"(feed(self, timestamp_ns, image0, image1=None, depth=None, mask=None)
--

Tracks one frame and returns its TrackingResult.

timestamp_ns: int, nanoseconds, later than that of the frame before.
image0: of camera 0, uint8 array (H, W), or (H, W, 3) in the order red, green, blue, of the size
    that the calibration states.
image1: of camera 1 of a stereo pair, the same.
depth: along z, registered to camera 0: uint16 array (H, W) in units of the sensor (setting
    depth.factor of them are a metre), or float32 in metres, which is rounded to these units;
    0 (and nan) where there is none.
mask: of camera 0, uint8 or bool array (H, W), 0 where the image is not to be used.

Arrays whose rows are contiguous are read in place, others are copied; none is kept. Other threads
of Python run meanwhile; they must not write into the arrays.

TypeError, ValueError for arrays of the wrong type or shape and for images that the setup does not
have; InputError for a wrong size or time; RuntimeError after finish().)");
}

void bind_imu(SystemClass& system) {
  system
      .def("feed_imu",
           &PythonSystem::feed_imu,
           py::arg("timestamp_ns"),
           py::arg("angular_velocity"),
           py::arg("acceleration"),
           R"(feed_imu(self, timestamp_ns, angular_velocity, acceleration)
--

Measurements of an IMU (docs/imu.md), which frames fed later make use of: one, or arrays of N.
timestamp_ns: int or array (N,), later than those before, others are left out.
angular_velocity, acceleration: array (3,) or (N, 3), rad/s and m/s^2, gravity included.)")
      .def("inertial",
           &PythonSystem::inertial,
           R"(inertial(self)
--

What the IMU told so far: an InertialReport, or None without samples. Final after finish().)")
      .def("inertial_path",
           &PythonSystem::inertial_path,
           R"(inertial_path(self)
--

A list of NavigationState for the frames of the largest part, after finish(); empty without metres.)");
}

void bind_control(SystemClass& system) {
  system
      .def("finish", &PythonSystem::finish, R"(finish(self)
--

Ends the input: waits for outstanding mapping and refines the whole map. No feed() afterwards.)")
      .def("reset", &PythonSystem::reset, R"(reset(self)
--

Begins anew with an empty map; frames count from 0 again.)")
      .def("set_mapping", &PythonSystem::set_mapping, py::arg("is_on"), R"(set_mapping(self, is_on)
--

Off: the camera is followed in the map, which stays as it is. On at first.)")
      .def(
          "save",
          [](PythonSystem& self, const py::object& path) {
            self.save(path_argument("path", path));
          },
          py::arg("path"),
          R"(save(self, path)
--

Writes the newest map to a file (.wmap), whole or not at all. OutputError when that fails.)")
      .def(
          "view",
          [](PythonSystem& self, const py::object& address) {
            return self.view(address_argument(address));
          },
          py::arg("address") = "8080",
          R"(view(self, address='8080')
--

Shows the frames fed from now on, and the map, in the browser: a Viewer at a port of this machine
(0: a free one) or 'HOST:PORT', until its close() or as long as the System is there.)")
      .get("is_finished", "bool: finish() was called.", &PythonSystem::is_finished)
      .def("__enter__", [](const py::object& self) { return self; })
      .def("__exit__", [](PythonSystem& self, const py::args& args) {
        if (args[0].is_none()) self.finish();
      });
}

void bind_memory(SystemClass& system) {
  system.def(
      "keep_map_in",
      [](PythonSystem& self, const py::object& folder, const py::object& max_memory_gb) {
        self.keep_map_in(path_argument("folder", folder),
                         number_argument("max_memory_gb", max_memory_gb));
      },
      py::arg("folder"),
      py::kw_only(),
      py::arg("max_memory_gb"),
      R"(keep_map_in(self, folder, *, max_memory_gb)
--

Limits the memory of a large map: whenever the process has more than max_memory_gb (0 to 1e6, of
10^9 bytes) in memory, what only searching and joining need lies in a file without a name in this
folder, which is gone with the System. Results are the same bits; see docs/performance.md. Before
the first feed(), else RuntimeError. OutputError where the file cannot be made.)");
}

void bind_reading(SystemClass& system) {
  system
      .def("map", &PythonSystem::map, R"(map(self)
--

The newest finished Map, which never changes. The same object as last time where nothing new is
there, so that `is` tells whether the map changed.)")
      .def("trajectory", &PythonSystem::trajectory, R"(trajectory(self)
--

Every frame that has a pose, with what is known now: a Trajectory. Final after finish().)")
      .def("frame_states", &PythonSystem::frame_states, R"(frame_states(self)
--

State of every frame fed so far, including those filled in after the fact: a list of str.)")
      .def("statistics", &PythonSystem::statistics, R"(statistics(self)
--

Totals up to the map that map() gives: Statistics. Final after finish().)")
      .def("ego_mask", &PythonSystem::ego_mask, R"(ego_mask(self)
--

What was found to move along with camera 0 by now: an array of uint8 (H, W), 0 there, else 255; None
while nothing was.)")
      .def("calibration", &PythonSystem::calibration, R"(calibration(self)
--

What the images told of each number of the calibration, up to the map that map() gives: a list of
CalibrationEstimate, empty as long as they did not contradict it. Final after finish().)")
      .def("details", &PythonSystem::details, R"(details(self)
--

More of the frame fed last, for those who show it: FrameDetails.)");
}

}  // namespace

void bind_system(py::module_& module) {
  SystemClass system(module, "System", R"(Visual SLAM on a stream of frames.

One thread at a time; a second one gets a RuntimeError. As a context manager it finishes at the end
of the block, unless that raised.)");
  system.def(
      py::init(&make_system),
      py::arg("cameras"),
      py::kw_only(),
      py::arg("setup") = py::none(),
      py::arg("timing") = "lockstep",
      py::arg("settings") = py::none(),
      py::arg("seed") = py::none(),
      py::arg("map") = py::none(),
      R"(__init__(self, cameras, *, setup=None, timing='lockstep', settings=None, seed=None, map=None)
--

cameras: path of a camchain, a dict of the same content, a list of these (later ones override), or
    a Calibration. Files and dicts may hold settings, too.
setup: 'mono', 'stereo' or 'rgbd'. None: stereo with two cameras; with one, the first frame decides
    by having depth or not.
timing: 'inline' (one thread), 'lockstep' (threads, same results) or 'realtime' (never waits for
    the mapper; results depend on how fast it is).
settings: dict by dotted key or by section, for example {'features.count': 1500}.
seed: of all random numbers.
map: a Map to go on in; a copy is extended.

InputError for cameras or settings that are malformed or cannot work together.)");
  bind_feed(system);
  bind_imu(system);
  bind_control(system);
  bind_memory(system);
  bind_reading(system);
}

}  // namespace waymark::python
