// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <array>

#include "waymark/atlas/atlas.h"

namespace waymark::python {

namespace py = pybind11;

/// The contents of an atlas as lists of dicts; read_contents() gives the same back to the bit.
py::dict describe_contents(const AtlasContents& contents);
AtlasContents read_contents(const py::dict& described);

py::dict describe_link(const AtlasLink& link);

/// Quaternion x y z w, translation, scale.
std::array<double, 8> numbers_of(const Sim3& transform);

/// As a flat list: of a, of b, of a, ...
py::list describe_landmarks(const SharedLandmarks& landmarks);
SharedLandmarks read_landmarks(const py::handle& flat);

}  // namespace waymark::python
