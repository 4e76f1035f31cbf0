// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <set>
#include <utility>

#include "waymark/atlas/atlas.h"
#include "waymark/map/map.h"

namespace waymark {

/// The tiles of an atlas that were used last, at most so many.
class OpenTiles {
 public:
  OpenTiles(const Atlas& atlas, std::size_t max_count) : atlas_(atlas), max_count_(max_count) {}

  /// The map of a tile, opened if it is not open; stays as long as somebody has it.
  std::shared_ptr<const Map> get(std::uint32_t tile);

  /// How often a tile was read.
  std::size_t num_opened() const { return num_opened_; }
  /// How many different ones.
  std::size_t num_tiles_seen() const { return seen_.size(); }

 private:
  const Atlas& atlas_;
  const std::size_t max_count_;
  std::list<std::pair<std::uint32_t, std::shared_ptr<const Map>>> open_;  ///< Newest first.
  std::size_t num_opened_ = 0;
  std::set<std::uint32_t> seen_;
};

}  // namespace waymark
