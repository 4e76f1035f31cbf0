// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace waymark {

/// Adds an option that takes one of a few names, each standing for a value.
template <class Value>
void add_choice(CLI::App& command,
                const std::string& name,
                Value& value,
                const std::map<std::string, Value>& choices,
                const std::string& help) {
  command
      .add_option_function<std::string>(
          name, [&value, choices](const std::string& chosen) { value = choices.at(chosen); }, help)
      ->check(CLI::IsMember(choices))
      ->type_name("NAME");
}

}  // namespace waymark
