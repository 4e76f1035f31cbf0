// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include "waymark/atlas/atlas.h"

namespace waymark::python {

namespace py = pybind11;

/// The contents of an atlas as lists of dicts; read_contents() gives the same back to the bit.
py::dict describe_contents(const AtlasContents& contents);
AtlasContents read_contents(const py::dict& described);

}  // namespace waymark::python
