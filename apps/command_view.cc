// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "commands.h"
#include "terminal.h"
#include "waymark/input/decode.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/session/session_options.h"
#include "waymark/view/viewer.h"

namespace waymark {
namespace {

using namespace std::chrono_literals;

struct ViewOptions {
  std::filesystem::path map;
  std::string address = "8080";
};

/// The keyframes stand for the trajectory.
std::vector<FrameNote> note_keyframes(const Map& map) {
  std::vector<FrameNote> notes;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    FrameNote note;
    note.frame = keyframe.frame;
    note.timestamp_ns = keyframe.timestamp_ns;
    note.state = FrameState::kTracked;
    note.final_pose = keyframe.rig_from_world.inverse();
    note.submap = keyframe.submap;
    notes.push_back(note);
  });
  std::sort(notes.begin(), notes.end(), [](const FrameNote& a, const FrameNote& b) {
    return a.frame < b.frame;
  });
  return notes;
}

std::vector<FeatureColors> sample_images(const StoredMap& stored) {
  std::vector<FeatureColors> colors;
  for (const auto& [id, bytes] : stored.images) {
    const Keyframe* keyframe = stored.map->keyframes().find(id);
    const std::optional<ColorImage> image = decode_color_image(*bytes);
    if (!keyframe || !image) continue;
    FeatureColors& found = colors.emplace_back();
    found.frame = keyframe->frame;
    for (std::size_t i = 0; i < keyframe->features->num_primary; ++i) {
      const Keypoint& keypoint = keyframe->features->keypoints[i];
      const int x = std::clamp(static_cast<int>(keypoint.x_px + 0.5f), 0, image->width_px - 1);
      const int y = std::clamp(static_cast<int>(keypoint.y_px + 0.5f), 0, image->height_px - 1);
      found.rgb.push_back(image->row(y)[x]);
    }
  }
  return colors;
}

ViewUpdate show(const StoredMap& stored) {
  ViewUpdate update;
  update.map = stored.map;
  update.frames = note_keyframes(*stored.map);
  update.colors = sample_images(stored);
  SessionStatus& status = update.status;
  status.phase = SessionPhase::kMap;
  status.is_mapping = false;
  status.num_frames = status.num_tracked = update.frames.size();
  return update;
}

int view(const ViewOptions& options) {
  silence_image_library();
  const ViewerOptions address = parse_viewer_address(options.address, "--port");
  const StoredMap stored = load_map(options.map);
  SessionInfo info;
  info.program = std::string("waymark ") + WAYMARK_VERSION;
  info.is_live = false;
  info.input = options.map.filename().string();
  Viewer viewer(address, std::move(info));
  ViewUpdate update = show(stored);
  viewer.try_push(update);
  catch_interrupts();
  print_result("{}\n", describe(*stored.map, options.map));
  print_result("open {} in a browser; Ctrl-C ends\n", viewer.url());
  std::fflush(stdout);
  while (!is_interrupted()) {
    std::this_thread::sleep_for(50ms);
    if (const auto problem = viewer.next_problem()) {
      print_message("warning: viewer: {}\n", *problem);
    }
  }
  return kDone;
}

}  // namespace

void add_view_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<ViewOptions>();
  CLI::App& view_command =
      *program.add_subcommand("view", "Show a saved map in the browser, until Ctrl-C");
  view_command.add_option("MAP", options->map, "Map file (.wmap)")->required();
  view_command
      .add_option("--port",
                  options->address,
                  "[HOST:]PORT to serve the page at; 0: a free one; with HOST 0.0.0.0 others can "
                  "reach it, who have the URL with its token [8080]")
      ->type_name("[HOST:]PORT");
  view_command.callback([options, &command] { command = [options] { return view(*options); }; });
}

}  // namespace waymark
