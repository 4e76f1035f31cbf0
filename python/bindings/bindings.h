// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "waymark/mapfile/map_file.h"
#include "waymark/results/trajectory.h"
#include "waymark/system/system.h"

namespace waymark::python {

namespace py = pybind11;

/// A frozen map, with what belongs to it in a file.
struct PythonMap {
  StoredMap stored;
  const Map& map() const { return *stored.map; }
};

/// Features of a frame beside the landmarks they show, and what keeps both in memory.
struct PythonFeatures {
  std::shared_ptr<const Features> features;
  std::shared_ptr<const void> owner;  ///< Of the landmarks.
  const std::vector<LandmarkId>* landmarks = nullptr;
};

/// More of the newest frame, for those who show it: what a TrackingResult of Python leaves out,
/// since whoever keeps all results would keep all features.
struct FrameDetails {
  FrameId frame;
  std::shared_ptr<const Features> features;
  std::vector<LandmarkId> landmarks;
};

/// The turn of one thread at an object that lets other Python threads run while it works: a second
/// thread gets a RuntimeError rather than a race. Made and destroyed with the GIL held, which is
/// what guards the flag.
class Turn {
 public:
  /// process: that has its threads.
  Turn(bool& is_taken, const char* object, pid_t process = ::getpid()) : is_taken_(is_taken) {
    if (process != ::getpid()) {
      throw std::runtime_error(std::string(object) +
                               ": was made by another process, expected to be used there");
    }
    if (is_taken_) {
      throw std::runtime_error(std::string(object) +
                               ": is in use by another thread, expected one thread at a time");
    }
    is_taken_ = true;
  }
  ~Turn() { is_taken_ = false; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  bool& is_taken_;
};

/// Lets other threads of Python run, until it is destroyed. Once the interpreter ends, Python ends
/// daemon threads that want to run again by unwinding their stack, which no destructor survives:
/// such a thread rests here until the process ends.
class ReleasedGil {
 public:
  ReleasedGil() : state_(PyEval_SaveThread()) {}
  ~ReleasedGil() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      while (true) ::pause();
    }
  }
  ReleasedGil(const ReleasedGil&) = delete;
  ReleasedGil& operator=(const ReleasedGil&) = delete;

 private:
  PyThreadState* const state_;
};

/// Ends an object in the process that made it alone: one that is forked from it has none of its
/// threads, and would wait for them.
template <class T>
struct EndInItsProcess {
  void operator()(T* object) const {
    if (::getpid() == process) delete object;
  }
  pid_t process = ::getpid();
};
template <class T>
using OfOneProcess = std::unique_ptr<T, EndInItsProcess<T>>;
template <class T, class... Arguments>
OfOneProcess<T> make_of_one_process(Arguments&&... arguments) {
  return OfOneProcess<T>(new T(std::forward<Arguments>(arguments)...));
}

/// A class of Python whose properties are listed as name, docstring and getter.
template <class T, class... Options>
class Class : public py::class_<T, Options...> {
 public:
  Class(py::module_& module, const char* name, const char* about)
      : py::class_<T, Options...>(module, name, about) {
    // What __new__() alone made has no content: else pybind11 gives it memory that nobody filled.
    py::detail::get_type_info(typeid(T))->operator_new = [](std::size_t) -> void* {
      const std::string type = py::str(py::type::of<T>().attr("__name__"));
      throw py::type_error(type + ": was made by __new__() alone, expected a whole one");
    };
  }

  template <class... Arguments>
  Class& def(Arguments&&... arguments) {
    py::class_<T, Options...>::def(std::forward<Arguments>(arguments)...);
    return *this;
  }
  /// A read-only property; getter: of what a const T& has, or one of its members.
  template <class Getter>
  Class& get(const char* name, const char* about, Getter getter) {
    this->def_property_readonly(
        name, [getter](const T& self) { return std::invoke(getter, self); }, about);
    return *this;
  }
};

/// Of objects that have threads.
template <class T>
using ThreadedClass = Class<T, OfOneProcess<T>>;

/// The frames that have a pose, in order.
struct Trajectory {
  std::vector<TrajectoryFrame> frames;

  std::vector<StampedPose> poses() const {
    std::vector<StampedPose> poses;
    for (const TrajectoryFrame& frame : frames) {
      poses.push_back({frame.timestamp_ns, frame.world_from_rig});
    }
    return poses;
  }

  Trajectory of_submap(std::uint32_t submap) const {
    Trajectory part;
    std::copy_if(frames.begin(),
                 frames.end(),
                 std::back_inserter(part.frames),
                 [&](const TrajectoryFrame& frame) { return frame.submap.value == submap; });
    return part;
  }

  /// Of the sub-map with most frames, of equal ones the older.
  Trajectory largest() const {
    std::map<std::uint32_t, std::size_t> counts;
    for (const TrajectoryFrame& frame : frames) ++counts[frame.submap.value];
    const auto most =
        std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
          return a.second < b.second;
        });
    return most == counts.end() ? Trajectory{} : of_submap(most->first);
  }
};

// Each adds the classes and functions of the file of its name.
void bind_atlas(py::module_& module);
void bind_atlas_tasks(py::module_& module);
void bind_calibrate(py::module_& module);
void bind_report(py::module_& module);
void bind_camera(py::module_& module);
void bind_images(py::module_& module);
void bind_features(py::module_& module);
void bind_importing(py::module_& module);
void bind_map(py::module_& module);
void bind_map_tasks(Class<PythonMap, std::shared_ptr<PythonMap>>& map, py::module_& module);
void bind_map_tables(Class<PythonMap, std::shared_ptr<PythonMap>>& map, py::module_& module);
void bind_results(py::module_& module);
void bind_system(py::module_& module);
void bind_localizer(py::module_& module);
void bind_viewer(py::module_& module);

}  // namespace waymark::python
