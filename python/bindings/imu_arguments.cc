// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "arguments.h"
#include "arrays.h"

namespace waymark::python {

std::vector<ImuSample> imu_samples(const py::object& timestamp_ns,
                                   const py::object& angular_velocity,
                                   const py::object& acceleration) {
  const auto rows_of = [](const char* name, const py::object& values) {
    const auto array = py::array::ensure(values);
    if (!array) fail_type(name, values, "an array of shape (3,) or (N, 3)");
    const py::object rows = array.ndim() == 1 ? array.attr("reshape")(1, -1) : py::object(array);
    return numbers_argument(name, rows, 3);
  };
  std::vector<std::int64_t> times;
  if (!py::isinstance<py::iterable>(timestamp_ns)) {
    times.push_back(integer_argument("timestamp_ns", timestamp_ns));
  } else {
    for (const py::handle time : py::iter(timestamp_ns)) {
      times.push_back(integer_argument("timestamp_ns", time));
    }
  }
  const std::vector<double> turns = rows_of("angular_velocity", angular_velocity);
  const std::vector<double> pushes = rows_of("acceleration", acceleration);
  if (turns.size() != 3 * times.size() || pushes.size() != 3 * times.size()) {
    throw py::value_error(fmt::format(
        "angular_velocity and acceleration: have {} and {} rows, expected one for each of {} times",
        turns.size() / 3,
        pushes.size() / 3,
        times.size()));
  }
  std::vector<ImuSample> samples;
  for (std::size_t i = 0; i < times.size(); ++i) {
    samples.push_back({times[i],
                       Eigen::Map<const Eigen::Vector3d>(turns.data() + 3 * i),
                       Eigen::Map<const Eigen::Vector3d>(pushes.data() + 3 * i)});
  }
  return samples;
}

}  // namespace waymark::python
