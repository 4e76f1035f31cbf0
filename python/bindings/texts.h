// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace waymark::python {

namespace py = pybind11;

/// A str as UTF-8; ValueError for one that has none.
std::string text_argument(const char* name, py::handle text);

/// A str or os.PathLike, any bytes that the file system may hold; TypeError for others, ValueError
/// for one with a zero byte, which would end the name there.
std::filesystem::path path_argument(const char* name, py::handle path);

/// A text from outside. Files may hold any bytes: what is no UTF-8 gives the replacement character.
py::str text_of(std::string_view text);

}  // namespace waymark::python
