// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/calibrate.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "texts.h"

namespace waymark::python {
namespace {

EstimatedCalibration calibrate_input(const py::object& path, std::optional<double> fov_deg) {
  InputOptions reading;
  reading.setup = Setup::kMono;
  reading.enlarges_small = true;
  CalibrateOptions options;
  options.fov_deg = fov_deg;
  if (fov_deg && !(*fov_deg >= 5.0 && *fov_deg <= 240.0)) {
    throw py::value_error("fov_deg: is " + std::to_string(*fov_deg) + ", expected 5 to 240");
  }
  const std::unique_ptr<Input> input = open_input(path_argument("path", path), reading);
  const ReleasedGil released;
  return calibrate(*input, options);
}

}  // namespace

void bind_calibrate(py::module_& module) {
  Class<EstimatedCalibration>(
      module, "EstimatedCalibration", "What images tell of the camera that took them.")
      .get("calibration", "Calibration: for System().", &EstimatedCalibration::chain)
      .get("model",
           "str: 'perspective', 'fisheye' or 'equirectangular'.",
           [](auto& self) { return text_of(to_string(self.model)); })
      .get("fov_deg", "float: horizontal field of view.", &EstimatedCalibration::fov_deg)
      .get("focal_sigma",
           "float: standard deviation of the focal length, as part of it.",
           [](auto& self) { return self.sigmas[0]; })
      .get("is_sure",
           "bool: whether the motion told the focal length.",
           &EstimatedCalibration::is_sure)
      .get("report", "list of str: all that was found, in words.", [](auto& self) {
        return report(self);
      });
  module.def("calibrate",
             &calibrate_input,
             py::arg("path"),
             py::arg("fov_deg") = py::none(),
             R"(calibrate(path, fov_deg=None)
--

Finds the model and the calibration of the camera of an input from its images alone and returns an
EstimatedCalibration. path is as for open_input(); of several cameras the first counts.

fov_deg: horizontal field of view if it is roughly known. None: estimated.

InputError where there is no image.)");
}

}  // namespace waymark::python
