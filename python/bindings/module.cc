// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The extension waymark._waymark. Docstrings begin with the signature in the form that Python's
// inspect reads.
#include <pybind11/pybind11.h>

#include "bindings.h"
#include "waymark/base/check.h"
#include "waymark/base/id.h"
#include "waymark/input/decode.h"

namespace waymark::python {
namespace {

void bind_errors(py::module_& module) {
  py::object input = py::register_exception<InputError>(module, "InputError", PyExc_ValueError);
  input.doc() = "Bad input from outside. One line: where, what is wrong, what was expected.";
  py::object output = py::register_exception<OutputError>(module, "OutputError", PyExc_OSError);
  output.doc() = "Results cannot be written. One line of the same form.";
}

/// Everything is known to users under the name of the package.
void rename_module(py::module_& module) {
  for (const auto& [name, value] : module.attr("__dict__").cast<py::dict>()) {
    if (py::isinstance<py::type>(value)) value.attr("__module__") = "waymark";
  }
}

}  // namespace
}  // namespace waymark::python

PYBIND11_MODULE(_waymark, module) {
  namespace python = waymark::python;
  pybind11::options options;
  options.disable_function_signatures();
  module.doc() = "The engine behind the package waymark.";
  module.attr("__version__") = WAYMARK_VERSION;
  module.attr("NO_ID") = waymark::LandmarkId{}.value;
  waymark::silence_image_library();
  python::bind_errors(module);
  python::bind_camera(module);
  python::bind_images(module);
  python::bind_features(module);
  python::bind_map(module);
  python::bind_results(module);
  python::bind_system(module);
  python::bind_localizer(module);
  python::rename_module(module);
}
