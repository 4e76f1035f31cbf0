// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "texts.h"

#include "arrays.h"

namespace waymark::python {

std::string text_argument(const char* name, py::handle text) {
  py::ssize_t size = 0;
  const char* bytes = PyUnicode_AsUTF8AndSize(text.ptr(), &size);
  if (bytes == nullptr) {
    PyErr_Clear();
    fail_value(name, text, "text of whole characters");
  }
  return {bytes, static_cast<std::size_t>(size)};
}

std::filesystem::path path_argument(const char* name, py::handle path) {
  if (!py::isinstance<py::str>(path) && !py::hasattr(path, "__fspath__")) {
    fail_type(name, path, "a path");
  }
  const py::bytes encoded = py::module_::import("os").attr("fsencode")(path);
  const std::string bytes = encoded;
  if (bytes.find('\0') != std::string::npos) {
    throw py::value_error(std::string(name) + ": has an embedded null byte, expected a path");
  }
  return bytes;
}

py::str text_of(std::string_view text) {
  const auto size = static_cast<py::ssize_t>(text.size());
  auto decoded = py::reinterpret_steal<py::str>(PyUnicode_DecodeUTF8(text.data(), size, "replace"));
  if (!decoded) throw py::error_already_set();
  return decoded;
}

}  // namespace waymark::python
