// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

namespace waymark {

/// A regular file, opened to be read. Throws InputError when it is missing, something else (a pipe
/// may never end) or unreadable; expected says what the file should have been.
std::ifstream open_regular_file(const std::filesystem::path& path, std::string_view expected);

}  // namespace waymark
