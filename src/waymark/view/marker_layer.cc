// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <vector>

#include "waymark/view/scene.h"

namespace waymark {
namespace {

Message encode(const Map& map) {
  const std::vector<MapMarker>& markers = map.markers();
  MessageWriter writer(MessageKind::kMarkers, markers.size());
  for (const MapMarker& marker : markers) writer.add(static_cast<std::uint32_t>(marker.id));
  for (const MapMarker& marker : markers) {
    const Rigid3 world_from_marker = map.world_from_marker(marker);
    for (std::size_t i = 0; i < 4; ++i) {
      writer.add(Eigen::Vector3d(world_from_marker * marker_corner(i, marker.side_m)));
    }
  }
  for (const MapMarker& marker : markers) {
    writer.add(std::uint32_t{marker.surveyed_world_from_marker.has_value()});
  }
  for (const MapMarker& marker : markers) writer.add(saturate16(map.submap_of(marker).value));
  writer.pad_to(4);
  return writer.finish();
}

}  // namespace

void MarkerLayer::differences(const Map& map, std::vector<Message>& messages) {
  if (!told_ && map.markers().empty()) return;
  Message now = encode(map);
  if (told_ && *told_ == *now) return;
  messages.push_back(now);
  told_ = std::move(now);
}

void MarkerLayer::snapshot(const Map& map, std::vector<Message>& messages) {
  if (map.markers().empty()) return;
  told_ = encode(map);
  messages.push_back(told_);
}

}  // namespace waymark
