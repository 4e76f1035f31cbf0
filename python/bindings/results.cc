// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What System and Localizer return.
#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <set>
#include <string>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "pictures.h"
#include "texts.h"
#include "waymark/base/text.h"
#include "waymark/results/trajectory.h"
#include "waymark/system/system.h"

namespace waymark::python {
namespace {

py::object pose_or_none(const TrackingResult& result) {
  if (!result.world_from_rig) return py::none();
  return array_of(*result.world_from_rig);
}

py::dict stages_ms(const TrackingResult& result) {
  py::dict stages;
  for (std::size_t i = 0; i < kNumStages; ++i) stages[kStageNames[i]] = result.stages.ms[i];
  return stages;
}

std::string describe_result(const TrackingResult& result) {
  std::string text = "<TrackingResult frame " + std::to_string(result.frame.value) + ": " +
                     std::string(to_string(result.state));
  if (result.reason != FrameReason::kNone) text += ", " + std::string(to_string(result.reason));
  return text + ", " + count_of(result.num_inliers, "inlier") + ">";
}

void bind_tracking_result(py::module_& module) {
  Class<TrackingResult>(
      module, "TrackingResult", R"(What is known of a frame right after it was fed.

A result without a pose says how far the search got: how many places were compared
(num_candidates), and of the one that came closest the matches, the inliers and why it was
refused (reason).)")
      .get("frame", "int: of this session, from 0 on.", [](auto& self) { return self.frame.value; })
      .get("state",
           "str: 'initializing', 'tracked', 'filled' or 'lost'.",
           [](auto& self) { return to_string(self.state); })
      .get("reason",
           "str: why there is no pose, for example 'too_few_matches'; 'none' where there is one.",
           [](auto& self) { return to_string(self.reason); })
      .get("world_from_rig",
           "float64 array (4, 4) or None: where the rig (camera 0) is in the world and how it "
           "stands, in metres (map units for one camera).",
           &pose_or_none)
      .get("covariance",
           "float64 array (6, 6): of the pose, for perturbations exp(xi) * rig_from_world, xi = "
           "(rho, phi) in (m, rad); zeros where there is no pose.",
           [](auto& self) { return array_of(self.covariance); })
      .get("num_matches", "int: landmarks recognised.", &TrackingResult::num_matches)
      .get("num_inliers", "int: of these, that agree on the pose.", &TrackingResult::num_inliers)
      .get("num_candidates",
           "int: places in the map compared when all else had failed.",
           &TrackingResult::num_candidates)
      .get("is_keyframe", "bool: goes into the map.", &TrackingResult::is_keyframe)
      .get("submap",
           "int or None: the sub-map whose frame the pose is in.",
           [](auto& self) { return optional_id(self.submap); })
      .get("stages_ms", "dict of str to float: milliseconds by stage, in order.", &stages_ms)
      .get("tracking_ms",
           "float: from image to pose, without waiting for the mapper.",
           [](auto& self) { return self.stages.tracking_ms(); })
      .def("__repr__", &describe_result);
}

py::array matrices_of(const Trajectory& trajectory) {
  std::vector<double> values;
  values.reserve(16 * trajectory.frames.size());
  for (const TrajectoryFrame& frame : trajectory.frames)
    append_matrix(frame.world_from_rig, values);
  return array_of(std::move(values), {static_cast<py::ssize_t>(trajectory.frames.size()), 4, 4});
}

py::array is_filled(const Trajectory& trajectory) {
  std::vector<std::uint8_t> flags;
  for (const TrajectoryFrame& frame : trajectory.frames) {
    flags.push_back(frame.state == FrameState::kFilled);
  }
  return flags_of(std::move(flags));
}

template <class Field>
auto column_of(Field field) {
  return [field](const Trajectory& trajectory) {
    std::vector<std::decay_t<decltype(field(trajectory.frames.front()))>> values;
    for (const TrajectoryFrame& frame : trajectory.frames) values.push_back(field(frame));
    return array_of(std::move(values));
  };
}

void write(const Trajectory& trajectory, const py::object& path, const std::string& format) {
  for (const auto known :
       {TrajectoryFormat::kTum, TrajectoryFormat::kKitti, TrajectoryFormat::kEuroc}) {
    if (format == to_string(known))
      return write_trajectory(path_argument("path", path), trajectory.poses(), known);
  }
  throw py::value_error("format: is " + quote_for_message(format) +
                        ", expected tum, kitti or euroc");
}

/// "40 frames in 1 sub-map, 3.21 long": how far the camera went, in metres or map units.
std::string extent_of(const Trajectory& trajectory) {
  double length = 0.0;
  std::set<SubmapId> submaps;
  for (std::size_t i = 0; i < trajectory.frames.size(); ++i) {
    const TrajectoryFrame& frame = trajectory.frames[i];
    submaps.insert(frame.submap);
    if (i == 0 || frame.submap != trajectory.frames[i - 1].submap) continue;
    length +=
        (frame.world_from_rig.translation - trajectory.frames[i - 1].world_from_rig.translation)
            .norm();
  }
  return fmt::format("{} in {}, {:.3g} long",
                     count_of(trajectory.frames.size(), "frame"),
                     count_of(submaps.size(), "sub-map"),
                     length);
}

/// Of the largest sub-map: each has a world of its own.
std::string picture_of_trajectory(const Trajectory& trajectory) {
  MapPicture picture;
  const Trajectory largest = trajectory.largest();
  if (!largest.frames.empty()) picture.ways.emplace_back();
  for (const TrajectoryFrame& frame : largest.frames) {
    picture.ways.back().push_back(frame.world_from_rig);
  }
  return draw_html(picture, extent_of(trajectory));
}

void bind_trajectory(py::module_& module) {
  Class<Trajectory>(
      module,
      "Trajectory",
      "The frames that have a pose, in order, as arrays of the same length N. len() gives N.")
      .get("frames",
           "uint32 array (N,): TrackingResult.frame.",
           column_of([](const TrajectoryFrame& frame) { return frame.frame.value; }))
      .get("timestamps_ns",
           "int64 array (N,): as fed.",
           column_of([](const TrajectoryFrame& frame) { return frame.timestamp_ns; }))
      .get("world_from_rig", "float64 array (N, 4, 4): metres (map units for mono).", &matrices_of)
      .get("submaps",
           "uint32 array (N,): the sub-map whose frame the pose is in.",
           column_of([](const TrajectoryFrame& frame) { return frame.submap.value; }))
      .get("is_filled", "bool array (N,): True for poses found after the fact.", &is_filled)
      .def("of_submap", &Trajectory::of_submap, py::arg("submap"), R"(of_submap(self, submap)
--

The frames of one sub-map: a Trajectory.)")
      .def("largest", &Trajectory::largest, R"(largest(self)
--

The frames of the sub-map that has most of them: what the program writes to trajectory.txt.)")
      .def("write",
           &write,
           py::arg("path"),
           py::arg("format") = "tum",
           R"(write(self, path, format='tum')
--

Writes a file: 'tum' (t tx ty tz qx qy qz qw), 'kitti' or 'euroc'. OutputError when that fails.)")
      .def("__len__", [](const Trajectory& self) { return self.frames.size(); })
      .def("__repr__",
           [](const Trajectory& self) { return "<Trajectory of " + extent_of(self) + ">"; })
      .def("_repr_html_", &picture_of_trajectory);
}

void bind_statistics(py::module_& module) {
  Class<SystemStatistics>(module, "Statistics", "Totals of a session.")
      .get("num_keyframes", "int.", &SystemStatistics::num_keyframes)
      .get("num_landmarks", "int.", &SystemStatistics::num_landmarks)
      .get("num_submaps", "int: that are not joined.", &SystemStatistics::num_submaps)
      .get("num_loops", "int: loops closed.", &SystemStatistics::num_loops)
      .get("num_relocalizations",
           "int: times the lost camera was found again.",
           &SystemStatistics::num_relocalizations)
      .get("mapping_ms",
           "float64 array: milliseconds of the mapper per keyframe.",
           [](auto& self) { return array_of(self.mapping_ms); })
      .def("__repr__", [](const SystemStatistics& self) {
        return fmt::format("<Statistics: {}, {}, {}, {}, {}>",
                           count_of(self.num_keyframes, "keyframe"),
                           count_of(self.num_landmarks, "landmark"),
                           count_of(self.num_submaps, "sub-map"),
                           count_of(self.num_loops, "loop"),
                           count_of(self.num_relocalizations, "relocalization"));
      });
  Class<CalibrationEstimate>(module,
                             "CalibrationEstimate",
                             "What the images told of one number of the calibration; px, rad or 1.")
      .get("name", "str: for example 'cam0.fu', 'cam1.turn_y'.", &CalibrationEstimate::name)
      .get("given", "float: as the calibration says.", &CalibrationEstimate::given)
      .get("given_sigma",
           "float: standard deviation that was assumed of what was given.",
           &CalibrationEstimate::given_sigma)
      .get("change", "float: of the value in use from the one given.", &CalibrationEstimate::change)
      .get("sigma", "float: standard deviation of the value in use.", &CalibrationEstimate::sigma)
      .get("is_changed",
           "bool: whether the images contradict what was given.",
           &CalibrationEstimate::is_changed)
      .def("__repr__", [](const CalibrationEstimate& self) {
        return fmt::format("<CalibrationEstimate {}: {:.6g} -> {:.6g} +- {:.2g}>",
                           self.name,
                           self.given,
                           self.given + self.change,
                           self.sigma);
      });
}

void bind_inertial(py::module_& module) {
  Class<InertialReport>(module, "InertialReport", "What an inertial measurement unit told.")
      .get("is_used", "bool: whether vision agrees with it.", &InertialReport::is_used)
      .get("reason", "str: why it is not used.", &InertialReport::reason)
      .get("metric_from",
           "int: the frame from which on lengths of a map in mono are known, or None.",
           [](const InertialReport& self) -> std::optional<std::uint32_t> {
             if (!self.metric_from) return std::nullopt;
             return self.metric_from->value;
           })
      .get("scale_sigma",
           "float: standard deviation of lengths, as a part of them.",
           &InertialReport::scale_sigma)
      .get("gravity_in_world",
           "array (3,): acceleration of free fall in the map, m/s^2.",
           &InertialReport::gravity_in_world)
      .get("time_shift_s",
           "float: what is added to the time of an image to have it by the IMU's clock.",
           &InertialReport::time_shift_s)
      .get("time_shift_sigma_s",
           "float: its standard deviation.",
           &InertialReport::time_shift_sigma_s)
      .get("imu_from_rig",
           "array (4, 4): from the frame of camera 0 to that of the IMU, metres.",
           [](const InertialReport& self) { return Eigen::Matrix4d(self.imu_from_rig.matrix()); })
      .get("rotation_sigma_rad",
           "float: standard deviation of its rotation.",
           &InertialReport::rotation_sigma_rad)
      .get("lever_arm_sigma_m",
           "float: standard deviation of its translation.",
           &InertialReport::lever_arm_sigma_m)
      .get("gyroscope_bias",
           "array (3,): at the end, rad/s.",
           [](const InertialReport& self) { return self.biases.gyroscope; })
      .get("accelerometer_bias",
           "array (3,): at the end, m/s^2.",
           [](const InertialReport& self) { return self.biases.accelerometer; })
      .def("__repr__", [](const InertialReport& self) {
        return self.is_used ? std::string("<InertialReport>")
                            : fmt::format("<InertialReport: not used: {}>", self.reason);
      });
}

void bind_navigation_state(py::module_& module) {
  Class<NavigationState>(
      module, "NavigationState", "What vision and an inertial measurement unit tell of a frame.")
      .get("timestamp_ns", "int: of the image.", &NavigationState::timestamp_ns)
      .get(
          "world_from_rig",
          "array (4, 4): the pose, metres.",
          [](const NavigationState& self) { return Eigen::Matrix4d(self.world_from_rig.matrix()); })
      .get("velocity",
           "array (3,): of the unit in the axes of the world, m/s.",
           &NavigationState::velocity)
      .get("covariance",
           "array (9, 9): of exp(xi) * rig_from_world, xi = (rho, phi), and the velocity.",
           &NavigationState::covariance)
      .get("gyroscope_bias",
           "array (3,): rad/s.",
           [](const NavigationState& self) { return self.biases.gyroscope; })
      .get("accelerometer_bias", "array (3,): m/s^2.", [](const NavigationState& self) {
        return self.biases.accelerometer;
      });
}

}  // namespace

void bind_results(py::module_& module) {
  bind_tracking_result(module);
  bind_trajectory(module);
  bind_statistics(module);
  bind_inertial(module);
  bind_navigation_state(module);
}

}  // namespace waymark::python
