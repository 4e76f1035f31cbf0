// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "session_options.h"

#include <fmt/format.h>

#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"

namespace waymark {
namespace {

ConfigNode read_configuration(const SessionOptions& options) {
  std::vector<ConfigSource> sources;
  for (const std::filesystem::path& file : options.configs) {
    sources.push_back(ConfigSource::from_file(file));
  }
  for (const std::string& assignment : options.assignments) {
    sources.push_back(ConfigSource::from_assignment(assignment));
  }
  return merge_configs(sources);
}

std::string describe(const ChainCamera& camera, std::size_t index) {
  const CameraDescription& description = camera.description;
  return fmt::format("camera {}: {}, distortion {}, {}x{} px",
                     index,
                     description.camera_model,
                     description.distortion_model,
                     description.width_px,
                     description.height_px);
}

}  // namespace

Session open_session(const SessionOptions& options) {
  Session session;
  const ConfigNode config = read_configuration(options);
  read_settings(session.settings, config);
  if (options.seed) session.settings.seed = *options.seed;

  InputOptions reading = options.reading;
  reading.calibration = read_camchain(config);
  session.input = open_input(options.input, reading);

  const InputInfo& info = session.input->info();
  if (!info.calibration) {
    throw InputError(options.input.string(),
                     "carries no calibration, expected its cameras in a file given with -c");
  }
  if (info.calibration->depth_factor) {
    session.settings.depth.factor = *info.calibration->depth_factor;
  }
  session.system =
      std::make_unique<System>(make_rig(*info.calibration), session.settings, options.timing);

  session.description = info.lines;
  for (std::size_t i = 0; i < info.calibration->cameras.size(); ++i) {
    session.description.push_back(describe(info.calibration->cameras[i], i));
  }
  for (const std::string& note : info.calibration->notes) {
    session.description.push_back("note: " + note);
  }
  return session;
}

}  // namespace waymark
