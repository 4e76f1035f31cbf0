// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "atlas_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "waymark/base/text.h"
#include "waymark/exchange/export_scene.h"
#include "waymark/report/drawing.h"
#include "waymark/report/page.h"

namespace waymark {
namespace {

constexpr std::size_t kNumColors = 6;
constexpr std::size_t kMaxPointsOfTile = 500;

/// A part as it is drawn, and its keyframes where it has them.
struct DrawnPart {
  PathDrawing drawing;
  std::vector<StampedPose> poses;
};

std::string style_of(std::uint32_t recording) {
  return fmt::format("class=\"path{}\"", recording % kNumColors);
}

void add_tile(const AtlasTile& tile, const Map& map, DrawnPart& part) {
  const std::vector<StampedPose> poses = keyframe_trajectory(map, SubmapId{0});
  part.drawing.paths.push_back(path_of(poses, tile.atlas_from_tile, style_of(tile.recording)));
  if (!tile.is_metric) part.drawing.unit = "map units";
  for (const StampedPose& pose : poses) {
    part.poses.push_back(
        {pose.timestamp_ns, aligned_pose(tile.atlas_from_tile, pose.world_from_camera)});
  }
  const std::size_t step = map.landmarks().size() / kMaxPointsOfTile + 1;
  std::size_t at = 0;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    if (at++ % step != 0) return;
    const Eigen::Vector3d position = tile.atlas_from_tile * landmark.position_in_world;
    part.drawing.points.push_back(position.cast<float>());
  });
}

/// Parts by number.
std::map<std::uint32_t, DrawnPart> draw_parts(const Atlas& atlas) {
  std::map<std::uint32_t, DrawnPart> parts;
  for (const AtlasTile& tile : atlas.contents().tiles) {
    DrawnPart& part = parts[tile.frame];
    if (part.drawing.unit.empty()) part.drawing.unit = "m";
    part.drawing.title = fmt::format("Part {}", tile.frame);
    add_tile(tile, *atlas.load_tile(tile).map, part);
  }
  return parts;
}

std::string table_of_recordings(const AtlasContents& contents) {
  std::vector<std::vector<std::string>> rows;
  for (std::uint32_t i = 0; i < contents.recordings.size(); ++i) {
    std::uint64_t num_tiles = 0, num_keyframes = 0, num_landmarks = 0;
    std::set<std::uint32_t> parts;
    for (const AtlasTile& tile : contents.tiles) {
      if (tile.recording != i) continue;
      ++num_tiles;
      num_keyframes += tile.num_keyframes;
      num_landmarks += tile.num_landmarks;
      parts.insert(tile.frame);
    }
    rows.push_back({fmt::format("<svg viewBox=\"0 0 24 6\" class=\"key-line\" "
                                "aria-hidden=\"true\"><path {} d=\"M0 3H24\"/></svg>{}",
                                style_of(i),
                                escaped(contents.recordings[i].name)),
                    fmt::to_string(num_tiles),
                    fmt::to_string(num_keyframes),
                    fmt::to_string(num_landmarks),
                    fmt::to_string(fmt::join(parts, ", "))});
  }
  return table_of({"Recording", "Tiles", "Keyframes", "Landmarks", "Part"}, rows);
}

}  // namespace

std::string format_atlas_report(const Atlas& atlas) {
  const AtlasContents& contents = atlas.contents();
  const auto num_borders = std::ranges::count(contents.links, true, &AtlasLink::is_border);
  std::string body =
      fmt::format(
          "<h1>{}</h1>\n<p class=\"lead\">{} of {}; {} within recordings, {} that several "
          "show</p>\n",
          escaped(atlas.folder().string()),
          count_of(contents.tiles.size(), "tile"),
          count_of(contents.recordings.size(), "recording"),
          count_of(num_borders, "border"),
          count_of(static_cast<std::ptrdiff_t>(contents.links.size()) - num_borders, "place")) +
      section("Recordings", table_of_recordings(contents));
  for (const auto& [number, part] : draw_parts(atlas)) {
    const auto views = choose_views(part.poses);
    body += section(part.drawing.title,
                    "<div class=\"side-by-side\">\n<figure><figcaption>From above</figcaption>\n" +
                        draw_paths(part.drawing, views[0]) +
                        "</figure>\n<figure><figcaption>From the side</figcaption>\n" +
                        draw_paths(part.drawing, views[1]) + "</figure>\n</div>\n");
  }
  return format_page("Waymark: " + atlas.folder().string(), body);
}

}  // namespace waymark
