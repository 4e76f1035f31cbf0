// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "commands.h"
#include "python_tool.h"
#include "terminal.h"
#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/text.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/config_file.h"
#include "waymark/input/foreign_calibration.h"
#include "waymark/system/settings.h"

namespace waymark {
namespace {

int print_settings(bool is_markdown) {
  print_result("{}", is_markdown ? settings_as_markdown<Settings>() : settings_as_yaml(Settings()));
  return kDone;
}

int check_settings(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> notes;
  const std::vector<ConfigSource> sources = read_config_files(files, notes, read_settings_by_tool);
  for (const std::string& note : notes) print_result("note: {}\n", note);
  const ConfigNode config = merge_configs(sources);
  Settings settings;
  read_settings(settings, config);
  std::size_t num_cameras = 0;
  if (const std::optional<CameraChain> chain = read_camchain(config)) {
    num_cameras = make_rig(*chain).cameras.size();
    for (const std::string& note : chain->notes) print_result("note: {}\n", note);
  }
  print_result("valid: {}\n", count_of(num_cameras, "camera"));
  return kDone;
}

using CalibrationReader = CameraChain (*)(const ConfigSource& source);

CameraChain read_any(const ConfigSource& source) {
  if (auto chain = read_foreign_cameras(source, read_settings_by_tool)) return *std::move(chain);
  throw InputError(source.name,
                   "is no calibration of another program that is known, expected one of those in "
                   "docs/calibration.md");
}

int print_camchain(CalibrationReader read, const std::vector<std::filesystem::path>& files) {
  const bool is_pair = read == read_ros_calibration && files.size() == 2;
  if (files.size() != 1 && !is_pair) {
    throw InputError("command line",
                     fmt::format("--from has {} files, expected one calibration", files.size()));
  }
  const ConfigSource source = read_calibration_source(files[0]);
  const CameraChain chain =
      is_pair ? read_ros_pair(source, read_calibration_source(files[1])) : read(source);
  for (const std::string& note : chain.notes) print_message("note: {}\n", note);
  print_result("{}", format_camchain(chain));
  return kDone;
}

}  // namespace

void add_config_command(CLI::App& program, Command& command) {
  const auto files = std::make_shared<std::vector<std::filesystem::path>>();
  CLI::App& config = *program.add_subcommand(
      "config", "Check settings files; without FILE print all settings with default, range, help");
  config.add_option("FILE", *files, "YAML files with cameras and settings, later ones override");
  const auto read = std::make_shared<CalibrationReader>(nullptr);
  add_choice<CalibrationReader>(config,
                                "--from",
                                *read,
                                {{"opencv", read_opencv_calibration},
                                 {"ros", read_ros_calibration},
                                 {"colmap", read_colmap_calibration},
                                 {"nerfstudio", read_nerfstudio_calibration},
                                 {"orbslam", read_settings_by_tool},
                                 {"any", read_any}},
                                "FILE is a calibration of opencv, ros (or two, of a pair), colmap, "
                                "nerfstudio, orbslam, or of any program that is known: print a "
                                "camchain");
  const auto is_markdown = std::make_shared<bool>(false);
  config.add_flag(
      "--markdown", *is_markdown, "Print the settings as tables of a page, docs/settings.md");
  config.callback([files, read, is_markdown, &command] {
    command = [files, read, is_markdown] {
      if (*read != nullptr) return print_camchain(*read, *files);
      return files->empty() ? print_settings(*is_markdown) : check_settings(*files);
    };
  });
}

}  // namespace waymark
