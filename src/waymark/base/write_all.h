// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace waymark {

/// Writes all of the bytes to an open file, whatever interrupts it; gives 0, or the error number.
/// Beyond the file size limit that is EFBIG: no signal ends the program.
int write_all(int descriptor, std::string_view bytes);

/// What an error number means, in words.
std::string error_text(int error_number);

}  // namespace waymark
