// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/datasets.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

constexpr int kMaxImageSize = 1 << 16;

std::filesystem::path mav0_of(const std::filesystem::path& folder) {
  return std::filesystem::is_directory(folder / "mav0") ? folder / "mav0" : folder;
}

/// Of a data set, where a pipe or a device has no business.
ConfigSource read_yaml(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
  return {path.string(), read_text_file(path, "a YAML file", kMaxBytes)};
}

const ConfigNode& require(const ConfigNode& config,
                          const ConfigSource& source,
                          std::string_view key) {
  const ConfigNode* node = config.find(key);
  if (node == nullptr) {
    throw InputError(source.name,
                     fmt::format("has no {}, expected the sensor.yaml of a camera", key));
  }
  return *node;
}

Rigid3 read_body_from_sensor(const ConfigNode& config, const ConfigSource& source) {
  const ConfigNode& node = require(config, source, "T_BS");
  const std::vector<double> values = config_doubles(require(node, source, "data"), "T_BS.data");
  if (values.size() != 16) {
    throw InputError(node.where(),
                     fmt::format("T_BS.data has {} numbers, expected 16", values.size()));
  }
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  return rigid_from_matrix(matrix, node.where(), "T_BS");
}

CameraChain read_sensors(const std::filesystem::path& mav0, std::size_t num_cameras) {
  CameraChain chain;
  Rigid3 body_from_camera0;
  for (std::size_t i = 0; i < num_cameras; ++i) {
    const std::filesystem::path path = mav0 / fmt::format("cam{}", i) / "sensor.yaml";
    const EurocSensor sensor = parse_euroc_sensor(read_yaml(path));
    if (i == 0) body_from_camera0 = sensor.body_from_sensor;
    const Rigid3 cam_from_rig =
        i == 0 ? Rigid3() : sensor.body_from_sensor.inverse() * body_from_camera0;
    chain.cameras.push_back({sensor.description, cam_from_rig});
  }
  return chain;
}

std::optional<CameraChain> read_calibration(const std::filesystem::path& mav0,
                                            std::size_t num_cameras) {
  if (std::filesystem::exists(mav0 / "cam0" / "sensor.yaml"))
    return read_sensors(mav0, num_cameras);
  const std::filesystem::path camchain = (mav0 / ".." / "dso" / "camchain.yaml").lexically_normal();
  if (!std::filesystem::exists(camchain)) return std::nullopt;
  return read_camchain(parse_config(read_yaml(camchain)));
}

std::vector<EurocImage> read_images(const std::filesystem::path& mav0, std::size_t camera) {
  const std::filesystem::path path = mav0 / fmt::format("cam{}", camera) / "data.csv";
  return parse_euroc_images(read_text_file(path, "the image list of an EuRoC data set"),
                            path.string());
}

/// The images of a camera, as far as their times increase.
std::vector<EurocImage> keep_increasing_images(Listing& listing,
                                               const std::filesystem::path& mav0,
                                               std::size_t camera) {
  const std::vector<EurocImage> images = read_images(mav0, camera);
  std::vector<std::int64_t> times_ns;
  for (const EurocImage& image : images) times_ns.push_back(image.timestamp_ns);
  const std::filesystem::path path = mav0 / fmt::format("cam{}", camera) / "data.csv";
  std::vector<EurocImage> used;
  for (const std::size_t i : keep_increasing(listing, times_ns, path.string())) {
    used.push_back(images[i]);
  }
  return used;
}

void add_right_images(Listing& listing, const std::filesystem::path& mav0) {
  std::vector<std::int64_t> left_ns;
  for (const ListedFrame& frame : listing.frames) left_ns.push_back(frame.timestamp_ns);
  std::vector<std::int64_t> right_ns;
  std::vector<std::filesystem::path> right;
  for (const EurocImage& image : keep_increasing_images(listing, mav0, 1)) {
    right_ns.push_back(image.timestamp_ns);
    right.push_back(mav0 / "cam1" / "data" / image.name);
  }
  const std::string where = (mav0 / "cam1" / "data.csv").string();
  add_partners(listing, partners_by_time(left_ns, right_ns), right, right_ns, where);
}

}  // namespace

std::vector<EurocImage> parse_euroc_images(std::string_view text, const std::string& name) {
  std::vector<EurocImage> images;
  RowReader rows(text, name, ',');
  while (rows.next()) {
    rows.expect_at_least(2, "2: nanoseconds,file name");
    EurocImage image{rows.nanoseconds(0), rows.relative_path(1), rows.where()};
    images.push_back(std::move(image));
  }
  if (images.empty()) throw InputError(name, "empty, expected rows of nanoseconds,file name");
  return images;
}

EurocSensor parse_euroc_sensor(const ConfigSource& source) {
  const ConfigNode config = parse_config(source);
  EurocSensor sensor;
  CameraDescription& description = sensor.description;
  description.where = source.name;
  description.camera_model = config_string(require(config, source, "camera_model"), "camera_model");
  description.intrinsics = config_doubles(require(config, source, "intrinsics"), "intrinsics");
  if (const ConfigNode* model = config.find("distortion_model")) {
    description.distortion_model = config_string(*model, "distortion_model");
    if (description.distortion_model == "radial-tangential")
      description.distortion_model = "radtan";
  }
  if (const ConfigNode* coefficients = config.find("distortion_coefficients")) {
    description.distortion_coeffs = config_doubles(*coefficients, "distortion_coefficients");
  }
  const ConfigNode& resolution = require(config, source, "resolution");
  const std::vector<double> size = config_doubles(resolution, "resolution", {1, kMaxImageSize});
  if (size.size() != 2)
    throw InputError(resolution.where(), "resolution is malformed, expected [width, height]");
  description.width_px = static_cast<int>(size[0]);
  description.height_px = static_cast<int>(size[1]);
  sensor.body_from_sensor = read_body_from_sensor(config, source);
  return sensor;
}

bool is_euroc(const std::filesystem::path& folder) {
  return std::filesystem::is_directory(folder / "mav0") ||
         std::filesystem::exists(folder / "cam0" / "data.csv");
}

Listing list_euroc(const std::filesystem::path& folder, const InputOptions& options) {
  const std::filesystem::path mav0 = mav0_of(folder);
  std::vector<Setup> offered = {Setup::kMono};
  if (std::filesystem::is_directory(mav0 / "cam1")) offered.push_back(Setup::kStereo);

  Listing listing;
  listing.format = "euroc";
  listing.title = "EuRoC / TUM-VI";
  listing.setup = choose_setup(folder, offered, options.setup);
  for (const EurocImage& image : keep_increasing_images(listing, mav0, 0)) {
    listing.frames.push_back({image.timestamp_ns, {mav0 / "cam0" / "data" / image.name}, {}});
  }
  if (listing.setup == Setup::kStereo) add_right_images(listing, mav0);
  if (!options.calibration)
    listing.calibration = read_calibration(mav0, num_cameras(listing.setup));
  return listing;
}

Rigid3 euroc_sensor_from_camera0(const std::filesystem::path& csv_path) {
  const std::filesystem::path sensor_folder = std::filesystem::absolute(csv_path).parent_path();
  const std::filesystem::path camera_yaml = sensor_folder.parent_path() / "cam0" / "sensor.yaml";
  if (sensor_folder.filename() == "cam0" || !std::filesystem::exists(camera_yaml)) return {};
  const Rigid3 body_from_camera0 = parse_euroc_sensor(read_yaml(camera_yaml)).body_from_sensor;
  const std::filesystem::path own_yaml = sensor_folder / "sensor.yaml";
  if (!std::filesystem::exists(own_yaml)) return body_from_camera0;
  const ConfigSource source = read_yaml(own_yaml);
  const ConfigNode config = parse_config(source);
  if (config.find("T_BS") == nullptr) return body_from_camera0;
  return read_body_from_sensor(config, source).inverse() * body_from_camera0;
}

std::optional<ImuStream> read_euroc_imu(const std::filesystem::path& folder) {
  const std::filesystem::path mav0 = mav0_of(folder);
  const std::filesystem::path table = mav0 / "imu0" / "data.csv";
  if (!std::filesystem::is_regular_file(table)) return std::nullopt;
  ImuStream stream = read_imu_file(table);
  const std::filesystem::path sensor = mav0 / "imu0" / "sensor.yaml";
  if (std::filesystem::exists(sensor) && std::filesystem::exists(mav0 / "cam0" / "sensor.yaml")) {
    stream.calibration.imu_from_rig = euroc_sensor_from_camera0(table);
  }
  const auto take = [&](const std::filesystem::path& path, const char* section) {
    if (!std::filesystem::exists(path)) return;
    ConfigSource source = read_yaml(path);
    source.key = section;
    fill_in(stream.calibration, read_imu_calibration(parse_config(source)));
  };
  take(sensor, "imu0");
  const std::filesystem::path dso = (mav0 / ".." / "dso").lexically_normal();  // Of TUM-VI.
  take(dso / "camchain.yaml", "");
  take(dso / "imu_config.yaml", "imu0");
  return stream;
}

}  // namespace waymark
