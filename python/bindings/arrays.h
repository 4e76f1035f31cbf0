// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"

namespace waymark::python {

namespace py = pybind11;

/// Lengths of the dimensions of an array.
using Shape = std::vector<py::ssize_t>;

/// "numpy array of float32 and shape (480, 640)", "list": what an argument is, for messages.
std::string describe(py::handle argument);

/// Throws a TypeError or ValueError "NAME: is WHAT, expected EXPECTED".
[[noreturn]] void fail_type(const char* name, py::handle argument, const std::string& expected);
[[noreturn]] void fail_value(const char* name, py::handle argument, const std::string& expected);

/// An argument that must be an array, or TypeError.
py::array array_argument(const char* name, py::handle argument, const std::string& expected);

/// An image borrowed from an array of T of shape (height, width). Where the rows of the array are
/// not contiguous, the array is replaced by a copy whose rows are. The view lives as long as the
/// array.
template <class T>
BasicImageView<T> borrow_image(py::array& array) {
  const bool has_rows = array.strides(1) == sizeof(T) && array.strides(0) > 0 &&
                        array.strides(0) % static_cast<py::ssize_t>(sizeof(T)) == 0 &&
                        reinterpret_cast<std::uintptr_t>(array.data()) % alignof(T) == 0;
  if (!has_rows) array = py::array_t<T, py::array::c_style | py::array::forcecast>(array);
  return {static_cast<const T*>(array.data()),
          static_cast<int>(array.shape(1)),
          static_cast<int>(array.shape(0)),
          array.strides(0) / static_cast<py::ssize_t>(sizeof(T))};
}

/// Whether an array holds values of T in the byte order of this machine.
template <class T>
bool holds(const py::array& array) {
  return py::isinstance<py::array_t<T>>(array);
}

/// Whole numbers are needed as such: TypeError for a float, ValueError for one that is too large.
std::int64_t integer_argument(const char* name, py::handle argument);

/// TypeError for what is no number.
double number_argument(const char* name, py::handle argument);

/// A pose from an array of shape (4, 4): TypeError, ValueError or InputError where it is none.
Rigid3 pose_argument(const char* name, py::handle argument);

/// Points from an array of shape (N, columns) of numbers.
std::vector<double> numbers_argument(const char* name, py::handle argument, int columns);

/// Takes away the right to write into an array.
py::array read_only(py::array array);

/// Values in memory that the owner keeps: the array looks at them and keeps the owner alive.
/// Strides in bytes.
template <class T>
py::array view_of(const T* values, Shape shape, Shape strides, std::shared_ptr<const void> owner) {
  auto keeper = std::make_unique<std::shared_ptr<const void>>(std::move(owner));
  const py::capsule base(
      keeper.get(), [](void* kept) { delete static_cast<std::shared_ptr<const void>*>(kept); });
  keeper.release();
  return read_only(
      py::array(py::dtype::of<T>(), std::move(shape), std::move(strides), values, base));
}

/// The same of values without gaps.
template <class T>
py::array view_of(const T* values, Shape shape, std::shared_ptr<const void> owner) {
  Shape strides(shape.size(), sizeof(T));
  for (std::size_t i = shape.size(); i-- > 1;) strides[i - 1] = strides[i] * shape[i];
  return view_of(values, std::move(shape), std::move(strides), std::move(owner));
}

/// Values that from now on belong to the array.
template <class T>
py::array array_of(std::vector<T> values, Shape shape) {
  const auto owner = std::make_shared<const std::vector<T>>(std::move(values));
  return view_of(owner->data(), std::move(shape), owner);
}
template <class T>
py::array array_of(std::vector<T> values) {
  const auto size = static_cast<py::ssize_t>(values.size());
  return array_of(std::move(values), {size});
}

/// A matrix, row by row.
template <class Derived>
py::array array_of(const Eigen::MatrixBase<Derived>& matrix) {
  using Scalar = typename Derived::Scalar;
  std::vector<Scalar> values;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      values.push_back(matrix(row, column));
    }
  }
  return array_of(std::move(values), {matrix.rows(), matrix.cols()});
}

inline py::array array_of(const Rigid3& pose) { return array_of(pose.matrix()); }

/// Of bool; the flags are 0 or 1.
py::array flags_of(std::vector<std::uint8_t> flags);

/// Appends the 16 numbers of a pose's matrix, row by row.
void append_matrix(const Rigid3& pose, std::vector<double>& values);

/// Ids as numpy has them: the largest number stands for none.
template <class Tag>
std::optional<std::uint32_t> optional_id(Id<Tag> id) {
  return id.is_valid() ? std::optional(id.value) : std::nullopt;
}

}  // namespace waymark::python
