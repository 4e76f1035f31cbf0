// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/report/assessment.h"

namespace waymark {

/// Text from anywhere as text of a page or as the value of an attribute, whatever it holds.
std::string escaped(std::string_view text);

/// A whole page with its style and script; it needs nothing else. title: text; body: HTML.
std::string format_page(std::string_view title, std::string_view body);

/// A section with a heading; body: HTML.
std::string section(std::string_view heading, std::string_view body);

/// A grade as it is shown everywhere.
std::string badge(Grade grade);

/// A table; cells are HTML. head: empty for one of names and what they stand for. style: a class;
/// "stack" puts the cells of a row below each other where there is little room.
std::string table_of(const std::vector<std::string>& head,
                     const std::vector<std::vector<std::string>>& rows,
                     std::string_view style = "");

}  // namespace waymark
