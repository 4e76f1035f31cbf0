// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace waymark {

/// A file of the page in the browser, as it is in viewer/dist.
struct Asset {
  std::string_view path;  ///< Begins with a slash.
  std::string_view content_type;
  std::string_view bytes;
};

/// All of them, sorted by path.
std::span<const Asset> list_assets();

/// Null if there is none.
const Asset* find_asset(std::string_view path);

/// By the suffix of a path.
std::string_view content_type_of(std::string_view path);

}  // namespace waymark
