// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/optimize_atlas.h"

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/atlas/adjust_tiles.h"
#include "waymark/atlas/anchors.h"
#include "waymark/base/text.h"

namespace waymark {

OptimizedAtlas optimize_atlas(Atlas& atlas, const std::function<void(const std::string&)>& say) {
  const ReadShared read_shared = [&](const AtlasLink& link) { return atlas.read_shared(link); };
  OptimizedAtlas result;
  atlas.change([&]() -> std::optional<AtlasChange> {
    result = {};
    AtlasContents contents = atlas.contents();
    solve_anchors(contents);
    for (const std::vector<std::uint32_t>& group : schedule_adjustment(contents)) {
      for (const std::uint32_t tile : group) {
        contents.tiles[tile].checksum = adjust_stored_tile(atlas, contents, tile, read_shared);
      }
      result.num_adjusted += group.size();
      if (say) say(count_of(result.num_adjusted, "tile") + " adjusted");
    }
    if (result.num_adjusted > 0) {
      for (AtlasLink& link : contents.links) {
        link.b_from_a = refit_link(atlas, contents, link, read_shared(link));
      }
      solve_anchors(contents);
    }
    return AtlasChange{std::move(contents), {}};
  });
  return result;
}

}  // namespace waymark
