// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "commands.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/atlas/export_atlas.h"
#include "waymark/base/atomic_file.h"
#include "waymark/exchange/align_map.h"
#include "waymark/input/decode.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/session/session_options.h"
#include "waymark/view/saved_map.h"
#include "waymark/view/viewer.h"

namespace waymark {
namespace {

using namespace std::chrono_literals;

struct ViewOptions {
  std::filesystem::path map;
  std::filesystem::path out;  ///< Where the page may write a scaled map to; empty: nowhere.
  std::string address = "8080";
};

/// As `waymark map align MAP --distance A B METRES -o OUT` does.
ViewReply write_scaled(const ViewRequest& request,
                       const StoredMap& stored,
                       const std::filesystem::path& path) {
  try {
    const KnownDistance distance = request.distance.value();
    StoredMap scaled = stored;
    scaled.map = align_to_distances(*stored.map, {&distance, 1}, "the distance").map.freeze();
    save_map(path, scaled);
    print_message("wrote {}\n", path.string());
    return {request, path.string(), ""};
  } catch (const std::exception& error) {
    return {request, "", error.what()};
  }
}

int view(const ViewOptions& options) {
  silence_image_library();
  const ViewerOptions address = parse_viewer_address(options.address, "--port");
  const StoredMap stored = load_map_or_atlas(options.map);
  SessionInfo info;
  info.program = std::string("waymark ") + WAYMARK_VERSION;
  info.is_live = false;
  info.input = options.map.filename().string();
  info.can_scale = !options.out.empty();
  info.keeps_images = !stored.images.empty();
  if (info.can_scale) AtomicFile{options.out};  // Fails now rather than later.
  Viewer viewer(address, std::move(info));
  ViewUpdate update = show_saved_map(stored);
  viewer.try_push(update);
  catch_interrupts();
  print_result("{}\n", describe(*stored.map, options.map));
  print_result("open {} in a browser; Ctrl-C ends\n", viewer.url());
  std::fflush(stdout);
  while (!is_interrupted()) {
    std::this_thread::sleep_for(50ms);
    while (const auto request = viewer.next_request()) {
      viewer.reply(write_scaled(*request, stored, options.out));
    }
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
  reads(view_command.add_option("MAP", options->map, "Map file (.wmap), or folder of an atlas"))
      ->required();
  writes(
      view_command.add_option("-o,--out",
                              options->out,
                              "Map file that the page may write the map to, scaled by a distance"));
  view_command
      .add_option("--port",
                  options->address,
                  "[HOST:]PORT to serve the page at; 0: a free one; with HOST 0.0.0.0 others can "
                  "reach it, who have the URL with its token [8080]")
      ->type_name("[HOST:]PORT");
  view_command.callback([options, &command] { command = [options] { return view(*options); }; });
}

}  // namespace waymark
