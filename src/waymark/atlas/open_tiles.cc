// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/open_tiles.h"

#include <algorithm>
#include <utility>

namespace waymark {

std::shared_ptr<const Map> OpenTiles::get(std::uint32_t tile) {
  const auto at = std::ranges::find_if(open_, [&](const auto& one) { return one.first == tile; });
  if (at != open_.end()) {
    open_.splice(open_.begin(), open_, at);
    return open_.front().second;
  }
  const AtlasTile& row = atlas_.contents().tiles[tile];
  std::shared_ptr<const Map> opened = atlas_.load_tile(row).map;
  ++num_opened_;
  seen_.insert(tile);
  if (open_.size() >= max_count_) open_.pop_back();
  open_.emplace_front(tile, std::move(opened));
  return open_.front().second;
}

}  // namespace waymark
