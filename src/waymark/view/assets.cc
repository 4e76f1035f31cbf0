// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/assets.h"

#include <algorithm>
#include <array>
#include <utility>

namespace waymark {

const Asset* find_asset(std::string_view path) {
  const std::span<const Asset> assets = list_assets();
  const auto found = std::find_if(
      assets.begin(), assets.end(), [&](const Asset& asset) { return asset.path == path; });
  return found == assets.end() ? nullptr : &*found;
}

std::string_view content_type_of(std::string_view path) {
  using Entry = std::pair<std::string_view, std::string_view>;
  constexpr std::array<Entry, 12> kTypes = {{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".wasm", "application/wasm"},
      {".txt", "text/plain; charset=utf-8"},
      {".webmanifest", "application/manifest+json"},
  }};
  for (const auto& [suffix, type] : kTypes) {
    if (path.ends_with(suffix)) return type;
  }
  return "application/octet-stream";
}

}  // namespace waymark
