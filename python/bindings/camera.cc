// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/camera.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/camera/rig.h"

namespace waymark::python {
namespace {

template <class Vector>
std::vector<Vector> rows_of(const std::vector<double>& values) {
  constexpr auto kColumns = static_cast<std::size_t>(Vector::RowsAtCompileTime);
  std::vector<Vector> rows;
  for (std::size_t i = 0; i < values.size(); i += kColumns) {
    rows.push_back(Eigen::Map<const Vector>(&values[i]));
  }
  return rows;
}

template <class Vector>
py::array table_of(const std::vector<Vector>& rows) {
  std::vector<double> values;
  for (const Vector& row : rows) values.insert(values.end(), row.begin(), row.end());
  const auto count = static_cast<py::ssize_t>(rows.size());
  return array_of(std::move(values), {count, Vector::RowsAtCompileTime});
}

py::tuple project(const RigCamera& self, const py::object& points_in_cam) {
  const auto points = rows_of<Eigen::Vector3d>(numbers_argument("points_in_cam", points_in_cam, 3));
  std::vector<Eigen::Vector2d> pixels(points.size(), Eigen::Vector2d::Zero());
  std::vector<std::uint8_t> is_visible(points.size());
  self.camera->project(points, pixels, is_visible);
  return py::make_tuple(table_of(pixels), flags_of(std::move(is_visible)));
}

py::tuple unproject(const RigCamera& self, const py::object& pixel_array) {
  const auto pixels = rows_of<Eigen::Vector2d>(numbers_argument("pixels", pixel_array, 2));
  std::vector<Eigen::Vector3d> bearings(pixels.size(), Eigen::Vector3d::Zero());
  std::vector<std::uint8_t> is_valid(pixels.size());
  self.camera->unproject(pixels, bearings, is_valid);
  return py::make_tuple(table_of(bearings), flags_of(std::move(is_valid)));
}

void bind_one_camera(py::module_& module) {
  Class<RigCamera>(module, "Camera", R"(A camera of a rig.

Its frame: x right, y down, z forward. Pixel (0, 0) is the centre of the top-left pixel.)")
      .get("model",
           "str: for example 'pinhole'.",
           [](auto& self) { return text_of(self.camera->model()); })
      .get("width_px", "int.", [](auto& self) { return self.camera->width_px(); })
      .get("height_px", "int.", [](auto& self) { return self.camera->height_px(); })
      .get("cam_from_rig",
           "float64 array (4, 4): the camera from camera 0, in metres.",
           [](auto& self) { return array_of(self.cam_from_rig); })
      .get("intrinsics",
           "list of float: as in a camchain.",
           [](auto& self) { return self.description.value_or(CameraDescription()).intrinsics; })
      .get("distortion_model",
           "str: as in a camchain.",
           [](auto& self) {
             return text_of(self.description.value_or(CameraDescription()).distortion_model);
           })
      .get("distortion_coeffs",
           "list of float: as in a camchain.",
           [](auto& self) {
             return self.description.value_or(CameraDescription()).distortion_coeffs;
           })
      .def("project", &project, py::arg("points_in_cam"), R"(project(self, points_in_cam)
--

Pixels of points, an array (N, 3) in the camera's frame. Returns a float64 array (N, 2) and a bool
array (N,), False where a point is not visible, whose pixel then means nothing.)")
      .def("unproject", &unproject, py::arg("pixels"), R"(unproject(self, pixels)
--

Unit bearings of pixels, an array (N, 2). Returns a float64 array (N, 3) and a bool array (N,),
False where a pixel has none.)")
      .def("__repr__", [](const RigCamera& self) {
        return text_of("<Camera " + std::string(self.camera->model()) + " of " +
                       std::to_string(self.camera->width_px()) + "x" +
                       std::to_string(self.camera->height_px()) + " px>");
      });
}

}  // namespace

void bind_camera(py::module_& module) {
  bind_one_camera(module);
  Class<CameraChain>(module, "Calibration", "The cameras of a rig, as a camchain describes them.")
      .def(py::init([](const py::object& cameras) { return read_cameras(cameras); }),
           py::arg("cameras"),
           R"(__init__(self, cameras)
--

cameras: path of a camchain, a dict of the same content, or a list of these (later ones override).
InputError for what is malformed.)")
      .get("cameras",
           "list of Camera: camera 0 is the rig's origin.",
           [](auto& self) { return make_rig(self).cameras; })
      .get("depth_factor",
           "float or None: units of the depth image per metre.",
           &CameraChain::depth_factor)
      .get("notes", "list of str: what was ignored, with its place.", [](auto& self) {
        py::list notes;
        for (const std::string& note : self.notes) notes.append(text_of(note));
        return notes;
      });
}

}  // namespace waymark::python
