// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <stdexcept>
#include <string>

namespace waymark::python {

/// The turn of one thread at an object that lets other Python threads run while it works: a second
/// thread gets a RuntimeError rather than a race. Made and destroyed with the GIL held, which is
/// what guards the flag.
class Turn {
 public:
  Turn(bool& is_taken, const char* object) : is_taken_(is_taken) {
    if (is_taken_) {
      throw std::runtime_error(std::string(object) +
                               ": is in use by another thread, expected one thread at a time");
    }
    is_taken_ = true;
  }
  ~Turn() { is_taken_ = false; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  bool& is_taken_;
};

}  // namespace waymark::python
