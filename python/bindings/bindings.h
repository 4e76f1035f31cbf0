// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "waymark/mapfile/map_file.h"

namespace waymark::python {

namespace py = pybind11;

/// A frozen map, with what belongs to it in a file.
struct PythonMap {
  StoredMap stored;
  const Map& map() const { return *stored.map; }
};

// Each adds the classes and functions of the file of its name.
void bind_camera(py::module_& module);
void bind_images(py::module_& module);
void bind_features(py::module_& module);
void bind_map(py::module_& module);
void bind_map_tables(py::class_<PythonMap, std::shared_ptr<PythonMap>>& map, py::module_& module);
void bind_results(py::module_& module);
void bind_system(py::module_& module);
void bind_localizer(py::module_& module);

}  // namespace waymark::python
