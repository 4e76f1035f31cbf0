// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/text.h"
#include "waymark/camera/camchain.h"
#include "waymark/exchange/openvslam_camera.h"
#include "waymark/exchange/openvslam_map.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {
namespace {

struct ImportOptions {
  std::filesystem::path map;
  std::filesystem::path settings;
  std::filesystem::path out;
};

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) print_message("note: {}\n", note);
}

/// Settings given where a map is expected would be called a damaged map.
void expect_no_settings(const ImportOptions& options) {
  const std::string suffix = options.map.extension().string();
  if (suffix != ".yaml" && suffix != ".yml") return;
  throw InputError(
      options.map.string(),
      "is a settings file, expected a map (.msg, .db); settings are given as --settings " +
          options.map.string());
}

std::optional<CameraChain> read_chain(const ImportOptions& options) {
  if (options.settings.empty()) return std::nullopt;
  CameraChain chain = read_openvslam_settings(ConfigSource::from_file(options.settings));
  print_notes(chain.notes);
  return chain;
}

/// Whether any keyframe was seen by the camera.
bool has_camera(const Map& map, const CameraDescription& camera) {
  bool is_found = false;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const std::optional<CameraDescription>& other = keyframe.rig->cameras[0].description;
    is_found |= other && other->is_same(camera);
  });
  return is_found;
}

int import_settings(const ImportOptions& options) {
  const std::string camchain = format_camchain(*read_chain(options));
  if (options.out.empty()) {
    print_result("{}", camchain);
  } else {
    write_file_atomically(options.out, camchain);
  }
  return kDone;
}

int import_map(const ImportOptions& options) {
  if (options.map.empty() && options.settings.empty()) {
    throw InputError("command line", "MAP is missing, expected a .msg or .db file, or --settings");
  }
  if (options.map.empty()) return import_settings(options);
  expect_no_settings(options);
  if (options.out.empty()) {
    throw InputError("command line", "-o is missing, expected the map file to write");
  }
  const std::optional<CameraChain> chain = read_chain(options);
  std::optional<ConfigSource> settings;
  if (chain) settings = ConfigSource::from_file(options.settings);
  ImportedMap imported = import_openvslam_file(options.map, settings);
  print_notes(imported.notes);
  if (chain && !has_camera(imported.map, chain->cameras[0].description)) {
    print_message("note: {}: its camera is none of the map's, which are used\n",
                  options.settings.string());
  }
  StoredMap stored;
  stored.map = imported.map.freeze();
  save_map(options.out, stored);
  print_result("{} keyframes, {} landmarks in {}\n",
               stored.map->keyframes().size(),
               stored.map->landmarks().size(),
               options.out.string());
  return kDone;
}

}  // namespace

void add_import_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<ImportOptions>();
  CLI::App& importing = *program.add_subcommand(
      "import", "Take over a map of OpenVSLAM or stella_vslam, or the cameras of its settings");
  importing.add_option("MAP", options->map, "Map file (.msg, .db)");
  importing.add_option("-o,--out", options->out, "Map file to write; without MAP a camchain");
  importing.add_option("--settings",
                       options->settings,
                       "Settings of the same program (YAML); without MAP they become a camchain");
  importing.callback([options, &command] { command = [options] { return import_map(*options); }; });
}

}  // namespace waymark
