// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/check.h"

#include "waymark/base/text.h"

namespace waymark {

InputError::InputError(const std::string& where, const std::string& what)
    : std::runtime_error(printable(where + ": " + what)) {}

OutputError::OutputError(const std::string& where, const std::string& what)
    : std::runtime_error(printable(where + ": " + what)) {}

OutputError::OutputError(const std::string& message) : std::runtime_error(printable(message)) {}

}  // namespace waymark
