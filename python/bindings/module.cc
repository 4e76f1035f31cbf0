// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The extension waymark._waymark. Docstrings begin with the signature in the form that Python's
// inspect reads.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "bindings.h"
#include "texts.h"
#include "waymark/base/check.h"
#include "waymark/base/id.h"
#include "waymark/input/decode.h"

namespace waymark::python {
namespace {

/// Messages may name files and quote texts that are no UTF-8, which py::register_exception() does
/// not survive.
template <class Error>
void bind_error(py::module_& module, const char* name, PyObject* base, const char* about) {
  static py::handle type;
  py::exception<Error> made(module, name, base);
  made.doc() = about;
  type = made.release();
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      PyErr_SetObject(type.ptr(), text_of(error.what()).ptr());
    }
  });
}

void bind_errors(py::module_& module) {
  bind_error<InputError>(
      module,
      "InputError",
      PyExc_ValueError,
      "Bad input from outside. One line: where, what is wrong, what was expected.");
  bind_error<OutputError>(module,
                          "OutputError",
                          PyExc_OSError,
                          "Results cannot be written. One line of the same form.");
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
  // Else the first array does it, and two threads that make one at once can wait for each other.
  pybind11::detail::npy_api::get();
  waymark::silence_image_library();
  python::bind_errors(module);
  python::bind_camera(module);
  python::bind_calibrate(module);
  python::bind_report(module);
  python::bind_images(module);
  python::bind_features(module);
  python::bind_map(module);
  python::bind_results(module);
  python::bind_system(module);
  python::bind_localizer(module);
  python::bind_viewer(module);
  python::bind_atlas(module);
  python::bind_atlas_tasks(module);
  python::bind_importing(module);
  python::rename_module(module);
}
