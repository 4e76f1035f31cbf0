// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <string_view>

namespace waymark {

/// A file of the page in the browser, as it is in viewer/dist.
struct Asset {
  std::string_view path;  ///< Begins with a slash.
  std::string_view bytes;
};

/// All of them, sorted by path.
std::span<const Asset> list_assets();

/// Null if there is none.
inline const Asset* find_asset(std::string_view path) {
  const std::span<const Asset> assets = list_assets();
  const auto found = std::ranges::find(assets, path, &Asset::path);
  return found == assets.end() ? nullptr : &*found;
}

}  // namespace waymark
