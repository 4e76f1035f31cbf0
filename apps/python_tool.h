// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"

namespace waymark {

/// Becomes main() of a module of the package waymark for Python, whose exit status is ours. needed:
/// modules that it needs beside, commas between. Throws InputError where there is no Python.
[[noreturn]] void become_python_tool(const std::string& module,
                                     const std::string& needed,
                                     const std::vector<std::string>& words);

/// The cameras of a file with settings of another SLAM program, as `waymark import --settings`
/// prints them. Throws InputError.
CameraChain read_settings_by_tool(const ConfigSource& source);

}  // namespace waymark
