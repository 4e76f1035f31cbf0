// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <string>

namespace waymark {

/// What is said of an exception to whoever runs the program, in one line.
std::string describe_failure(const std::exception_ptr& failure);

}  // namespace waymark
