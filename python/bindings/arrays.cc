// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "arrays.h"

#include <cstddef>

#include "waymark/camera/camchain.h"

namespace waymark::python {

std::string describe(py::handle argument) {
  if (argument.is_none()) return "None";
  if (!py::isinstance<py::array>(argument)) {
    return "of type " + std::string(py::str(py::type::of(argument).attr("__name__")));
  }
  return "an array of " + std::string(py::str(argument.attr("dtype"))) + " and shape " +
         std::string(py::str(argument.attr("shape")));
}

void fail_type(const char* name, py::handle argument, const std::string& expected) {
  throw py::type_error(std::string(name) + ": is " + describe(argument) + ", expected " + expected);
}

void fail_value(const char* name, py::handle argument, const std::string& expected) {
  throw py::value_error(std::string(name) + ": is " + describe(argument) + ", expected " +
                        expected);
}

py::array array_argument(const char* name, py::handle argument, const std::string& expected) {
  if (!py::isinstance<py::array>(argument)) fail_type(name, argument, expected);
  return py::reinterpret_borrow<py::array>(argument);
}

std::int64_t integer_argument(const char* name, py::handle argument) {
  if (!PyIndex_Check(argument.ptr())) fail_type(name, argument, "an int");
  const auto number = py::reinterpret_steal<py::object>(PyNumber_Index(argument.ptr()));
  if (!number) throw py::error_already_set();
  int overflow = 0;
  const long long value = PyLong_AsLongLongAndOverflow(number.ptr(), &overflow);
  if (overflow != 0) {
    throw py::value_error(std::string(name) + ": is " + std::string(py::str(number)) +
                          ", expected an int of 64 bits");
  }
  return value;
}

double number_argument(const char* name, py::handle argument) {
  const double value = PyFloat_AsDouble(argument.ptr());
  if (PyErr_Occurred()) {
    PyErr_Clear();
    fail_type(name, argument, "a number");
  }
  return value;
}

std::vector<double> numbers_argument(const char* name, py::handle argument, int columns) {
  const std::string expected = "numbers in an array of shape (N, " + std::to_string(columns) + ")";
  const auto numbers =
      py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(argument);
  if (!numbers) {
    PyErr_Clear();
    fail_type(name, argument, expected);
  }
  if (numbers.ndim() != 2 || numbers.shape(1) != columns) fail_value(name, argument, expected);
  return {numbers.data(), numbers.data() + numbers.size()};
}

Rigid3 pose_argument(const char* name, py::handle argument) {
  const std::vector<double> values = numbers_argument(name, argument, 4);
  if (values.size() != 16) fail_value(name, argument, "a matrix of shape (4, 4)");
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(values.data());
  return rigid_from_matrix(matrix, name, "the matrix");
}

py::array read_only(py::array array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

py::array flags_of(std::vector<std::uint8_t> flags) {
  return py::array(array_of(std::move(flags)).attr("view")("bool"));
}

void append_matrix(const Rigid3& pose, std::vector<double>& values) {
  const Eigen::Matrix4d matrix = pose.matrix();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) values.push_back(matrix(row, column));
  }
}

}  // namespace waymark::python
