// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace waymark {

/// Where who reads a message finds a page of the documentation: where it was installed with a
/// program, or as it is called in the sources. page: "docs/results.md", an anchor may follow.
/// program: the executable; share/doc/waymark lies below the same prefix.
std::string documentation(const std::string& page, const std::filesystem::path& program);

/// The same for the program that runs.
std::string documentation(const std::string& page);

}  // namespace waymark
