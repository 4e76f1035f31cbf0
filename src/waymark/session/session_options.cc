// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/session_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/text.h"
#include "waymark/camera/camchain.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/camera/resized_camera.h"
#include "waymark/input/imu_readers.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {
namespace {

constexpr const char* kPlaceholder =
    "a calibration with a focal length of 1 px or its principal point at 0, 0, a placeholder";

ConfigNode read_configuration(const SessionOptions& options, std::vector<std::string>& notes) {
  constexpr std::size_t kMaxConfigs = 100;
  if (options.configs.size() > kMaxConfigs) {
    throw InputError(
        "--config",
        fmt::format("is given {} times, expected at most {}", options.configs.size(), kMaxConfigs));
  }
  std::vector<ConfigSource> sources =
      read_config_files(options.configs, notes, options.read_slam_settings);
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

/// What is kept free of features as it has no direction; nothing if that is nothing.
std::optional<std::string> describe_unused(const Camera& camera, std::size_t index) {
  const double part = part_without_bearing(camera);
  if (part == 0.0) return std::nullopt;
  return fmt::format(
      "camera {}: the calibration has no direction for {:.1f} % of the pixels, which "
      "are kept free of features",
      index,
      100.0 * part);
}

/// Whether the calibration of an input has numbers that nobody measured: as of an identity matrix.
bool has_placeholder(const Input& input) {
  constexpr double kRounding = 1e-6;
  const auto is = [](double value, double other) { return std::abs(value - other) < kRounding; };
  const CameraChain chain = input.of_unchanged_images(*input.info().calibration);
  return std::ranges::any_of(chain.cameras, [&](const ChainCamera& camera) {
    if (!has_image_plane(camera.description)) return false;
    const auto plane = std::span(camera.description.intrinsics).last<kNumPlaneIntrinsics>();
    return (is(plane[0], 1.0) && is(plane[1], 1.0)) || (is(plane[2], 0.0) && is(plane[3], 0.0));
  });
}

/// Calibrates from the images of an input that carries no calibration.
EstimatedCalibration estimate(const SessionOptions& options, int seed, Input& input) {
  const std::string lack =
      input.info().calibration ? fmt::format("has {}", kPlaceholder) : "carries no calibration";
  if (!options.calibrate) {
    throw InputError(options.input.string(),
                     lack + ", expected its cameras in a file given with -c");
  }
  if (input.info().setup == Setup::kStereo) {
    throw InputError(options.input.string(),
                     lack + ", expected its two cameras in a file given with -c, or --setup mono");
  }
  CalibrateOptions calibrate_options = *options.calibrate;
  calibrate_options.seed = seed;
  return calibrate(input, calibrate_options);
}

/// Nothing where none or several of the cameras have images of the input's size.
std::optional<CameraChain> known_camera(const std::vector<CameraChain>& cameras,
                                        const InputInfo& info) {
  std::optional<CameraChain> found;
  for (const CameraChain& chain : cameras) {
    const CameraDescription& camera = chain.cameras.front().description;
    if (camera.width_px != info.width_px || camera.height_px != info.height_px) continue;
    if (found && !found->cameras.front().description.is_same(camera)) return std::nullopt;
    found = chain;
  }
  return found;
}

/// Opens the input anew with the calibration that the map knows or its images tell.
void find_calibration(const SessionOptions& options,
                      const ConfigNode& config,
                      PreparedInput& prepared,
                      std::vector<std::string>& notes) {
  const InputInfo& info = prepared.input->info();
  if (info.calibration) {
    notes.push_back(fmt::format("{}, which is taken as unknown", kPlaceholder));
  }
  std::optional<CameraChain> found = known_camera(options.known_cameras, info);
  if (found) {
    notes.push_back("no calibration is given: that of the map is taken");
  } else {
    prepared.estimated = estimate(options, prepared.settings.seed, *prepared.input);
    found = prepared.estimated->chain();
  }
  found->depth_factor =
      info.calibration ? info.calibration->depth_factor : read_depth_factor(config);
  prepared.reading.calibration = prepared.input->of_unchanged_images(*std::move(found));
  prepared.input.reset();  // A camera is open once at a time.
  prepared.input = open_input(options.input, prepared.reading);
}

}  // namespace

std::string describe(const Map& map, const std::filesystem::path& path) {
  return fmt::format("map {}: {}, {}, {}",
                     path.string(),
                     count_of(map.keyframes().size(), "keyframe"),
                     count_of(map.landmarks().size(), "landmark"),
                     is_metric(map) ? "in metres" : "scale free");
}

PreparedInput prepare_input(const SessionOptions& options) {
  PreparedInput prepared;
  std::vector<std::string> notes;
  const ConfigNode config = read_configuration(options, notes);
  read_settings(prepared.settings, config);
  if (options.seed) prepared.settings.seed = *options.seed;

  InputOptions reading = options.reading;
  reading.enlarges_small = true;
  reading.calibration = read_camchain(config);
  reading.imu_calibration = read_imu_calibration(config);
  if (options.calibration) reading.calibration = options.calibration;
  prepared.input = open_input(options.input, reading);

  prepared.reading = reading;
  if (!prepared.input->info().calibration || has_placeholder(*prepared.input)) {
    find_calibration(options, config, prepared, notes);
  }
  const InputInfo& info = prepared.input->info();
  if (info.calibration->depth_factor) {
    prepared.settings.depth.factor = *info.calibration->depth_factor;
  }
  prepared.rig = make_rig(*info.calibration);

  prepared.description = info.lines;
  if (prepared.estimated) {
    std::erase_if(prepared.description,
                  [](const auto& line) { return line.starts_with("calibration from"); });
    prepared.description.push_back("calibration estimated: " + describe(*prepared.estimated));
  }
  for (std::size_t i = 0; i < info.calibration->cameras.size(); ++i) {
    prepared.description.push_back(describe(info.calibration->cameras[i], i));
    if (auto unused = describe_unused(*prepared.rig.cameras[i].camera, i)) {
      prepared.description.push_back(*std::move(unused));
    }
  }
  notes.insert(notes.end(), info.calibration->notes.begin(), info.calibration->notes.end());
  for (const std::string& note : notes) prepared.description.push_back("note: " + note);
  return prepared;
}

Session open_session(const SessionOptions& options) {
  Session session{prepare_input(options), {}, nullptr};
  std::shared_ptr<const Map> map;
  std::optional<InertialReport> imu;
  if (!options.map_in.empty()) {
    StoredMap stored = load_map(options.map_in);
    map = std::move(stored.map);
    session.images = std::move(stored.images);
    imu = stored.imu;
    if (session.input->info().setup != Setup::kMono && !is_metric(*map)) {
      throw InputError(
          options.map_in.string(),
          "has no scale in metres, which stereo and depth need, expected --setup mono");
    }
    session.description.push_back(describe(*map, options.map_in));
  }
  session.system =
      std::make_unique<System>(session.rig, session.settings, options.timing, std::move(map));
  if (imu) session.system->set_imu(imu->calibration());
  return session;
}

}  // namespace waymark
