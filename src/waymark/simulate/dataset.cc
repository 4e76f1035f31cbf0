// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/dataset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/camera/camchain.h"
#include "waymark/image/opencv_image.h"
#include "waymark/input/imu_camchain.h"
#include "waymark/results/trajectory.h"
#include "waymark/simulate/video_compression.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

enum class Layout { kTumRgbd, kEuroc, kTumVi, kImageFolder };

/// Whether sensor.yaml of EuRoC describes such cameras: pinhole, radial-tangential.
bool is_perspective(const CameraDescription& camera) {
  return camera.camera_model == "pinhole" &&
         (camera.distortion_model == "none" || camera.distortion_model == "radtan");
}

Layout layout_of(const CameraChain& chain) {
  if (chain.depth_factor) return Layout::kTumRgbd;
  if (std::ranges::all_of(chain.cameras, is_perspective, &ChainCamera::description)) {
    return Layout::kEuroc;
  }
  return chain.cameras.size() > 1 ? Layout::kTumVi : Layout::kImageFolder;
}

std::string numbers(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string size_of(const CameraDescription& camera) {
  return fmt::format("[{}, {}]", camera.width_px, camera.height_px);
}

std::string format_sensor(const ChainCamera& camera, double rate_hz) {
  const CameraDescription& description = camera.description;
  const Eigen::Matrix4d body_from_sensor =
      camera.cam_from_rig.inverse().matrix().unaryExpr(&unsigned_zero);
  std::vector<double> coefficients = description.distortion_coeffs;
  if (coefficients.empty()) coefficients.assign(4, 0.0);
  std::string text = "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n";
  text +=
      fmt::format("  data: [{}]\n", fmt::join(body_from_sensor.reshaped<Eigen::RowMajor>(), ", "));
  text += fmt::format("rate_hz: {}\nresolution: {}\n", rate_hz, size_of(description));
  text += fmt::format("camera_model: pinhole\nintrinsics: {}\n", numbers(description.intrinsics));
  text += "distortion_model: radial-tangential\n";
  text += fmt::format("distortion_coefficients: {}\n", numbers(coefficients));
  return text;
}

template <class T>
void write_png(const fs::path& path, const BasicImage<T>& image) {
  bool is_written = false;
  try {
    is_written = cv::imwrite(path.string(), mat_of(image.view()), {cv::IMWRITE_PNG_COMPRESSION, 1});
  } catch (const cv::Exception& error) {
    throw OutputError(path.string(), error.err);
  }
  if (!is_written) throw OutputError(path.string(), "cannot be written");
}

std::string comma_separated(const Eigen::Vector3d& vector) {
  return fmt::format(
      "{},{},{}", unsigned_zero(vector.x()), unsigned_zero(vector.y()), unsigned_zero(vector.z()));
}

/// Samples as EuRoC's imu0/data.csv.
std::string format_imu_samples(std::span<const ImuSample> samples) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& sample : samples) {
    text += fmt::format("{},{},{}\n",
                        sample.timestamp_ns,
                        comma_separated(sample.angular_velocity),
                        comma_separated(sample.acceleration));
  }
  return text;
}

/// The beginning of EuRoC's imu0/sensor.yaml, whose body is the rig; the rest is imu.yaml.
std::string format_imu_mounting(const Rigid3& imu_from_rig) {
  const Eigen::Matrix4d body_from_imu = imu_from_rig.inverse().matrix().unaryExpr(&unsigned_zero);
  return fmt::format("sensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\n",
                     fmt::join(body_from_imu.reshaped<Eigen::RowMajor>(), ", "));
}

/// Kalibr's imu.yaml.
std::string format_imu_noise(const ImuNoise& noise, double rate_hz) {
  return fmt::format(
      "gyroscope_noise_density: {}\ngyroscope_random_walk: {}\n"
      "accelerometer_noise_density: {}\naccelerometer_random_walk: {}\n"
      "rostopic: /imu0\nupdate_rate: {}\n",
      noise.gyroscope,
      noise.gyroscope_walk,
      noise.accelerometer,
      noise.accelerometer_walk,
      rate_hz);
}

/// Writes frames of one layout and gathers its lists.
class Writer {
 public:
  Writer(const SequenceSpec& spec, fs::path folder)
      : spec_(spec),
        told_(told_chain(spec.chain, spec.told)),
        true_imu_(spec.imu ? spec.imu->calibration() : ImuCalibration{}),
        told_imu_(told_imu(true_imu_, spec.told)),
        folder_(std::move(folder)),
        layout_(layout_of(spec.chain)) {
    for (const fs::path& sub : image_folders()) make_output_folder(folder_ / sub);
    if (layout_ == Layout::kTumRgbd) make_output_folder(folder_ / "depth");
    if (spec.compressed_kbit_per_s <= 0.0) return;
    for (std::size_t i = 0; i < spec.chain.cameras.size(); ++i) {
      compressions_.emplace_back(spec.compressed_kbit_per_s, spec.rate_hz);
    }
  }

  void add(const SimulatedFrame& frame, const Rigid3& world_from_camera0) {
    const std::string seconds = format_seconds(frame.timestamp_ns);
    const bool is_csv = layout_ == Layout::kEuroc || layout_ == Layout::kTumVi;
    const std::vector<fs::path> folders = image_folders();
    lists_.resize(folders.size());
    for (std::size_t i = 0; i < folders.size(); ++i) {
      const Image& image = frame.images[i];
      const std::int64_t taken_ns = frame.image_timestamps_ns[i];
      const std::string name = (is_csv ? std::to_string(taken_ns) : seconds) + ".png";
      if (is_csv) lists_[i] += fmt::format("{},{}\n", taken_ns, name);
      if (layout_ == Layout::kTumRgbd) lists_[i] += fmt::format("{} rgb/{}\n", seconds, name);
      if (layout_ == Layout::kImageFolder) lists_[i] += seconds + "\n";
      write_png(folder_ / folders[i] / name,
                compressions_.empty() ? image : compressions_[i].compress(image));
    }
    if (layout_ == Layout::kTumRgbd) {
      const std::string depth_seconds = format_seconds(frame.depth_timestamp_ns);
      write_png(folder_ / "depth" / (depth_seconds + ".png"), frame.depth);
      depth_list_ += fmt::format("{0} depth/{0}.png\n", depth_seconds);
    }
    truth_.push_back({frame.timestamp_ns, world_from_camera0});
  }

  void finish() const {
    switch (layout_) {
      case Layout::kTumRgbd:
        write_file_atomically(folder_ / "rgb.txt", "# timestamp filename\n" + lists_[0]);
        write_file_atomically(folder_ / "depth.txt", "# timestamp filename\n" + depth_list_);
        break;
      case Layout::kImageFolder:
        write_file_atomically(folder_ / "times.txt", lists_[0]);
        break;
      case Layout::kEuroc:
      case Layout::kTumVi:
        write_sensors();
    }
    if (layout_ == Layout::kTumVi) {
      make_output_folder(folder_ / "dso");
      write_file_atomically(folder_ / "dso" / "camchain.yaml",
                            format_camchain_imu(told_, told_imu_));
    }
    const std::string told = format_camchain_imu(told_, told_imu_);
    const std::string truth = format_camchain_imu(spec_.chain, true_imu_);
    write_file_atomically(folder_ / "camchain.yaml", told);
    if (told != truth) write_file_atomically(folder_ / "calibration_true.yaml", truth);
    write_trajectory(folder_ / "groundtruth.txt", truth_, TrajectoryFormat::kTum);
  }

  void add_imu(const std::vector<ImuSample>& samples) const {
    const bool is_csv = layout_ == Layout::kEuroc || layout_ == Layout::kTumVi;
    const fs::path sensor = is_csv ? folder_ / "mav0" / "imu0" : folder_;
    make_output_folder(sensor);
    write_file_atomically(sensor / (is_csv ? "data.csv" : "imu0.csv"), format_imu_samples(samples));
    if (!told_imu_.noise) return;
    const std::string noise = format_imu_noise(*told_imu_.noise, spec_.imu->rate_hz);
    write_file_atomically(folder_ / "imu.yaml", noise);
    if (layout_ == Layout::kTumVi) {
      make_output_folder(folder_ / "dso");
      write_file_atomically(folder_ / "dso" / "imu_config.yaml", noise);
    }
    if (layout_ != Layout::kEuroc) return;
    write_file_atomically(sensor / "sensor.yaml",
                          format_imu_mounting(*told_imu_.imu_from_rig) + noise);
  }

 private:
  std::vector<fs::path> image_folders() const {
    if (layout_ == Layout::kTumRgbd) return {"rgb"};
    if (layout_ == Layout::kImageFolder) return {"images"};
    std::vector<fs::path> folders;
    for (std::size_t i = 0; i < spec_.chain.cameras.size(); ++i) {
      folders.push_back(fs::path("mav0") / fmt::format("cam{}", i) / "data");
    }
    return folders;
  }

  void write_sensors() const {
    for (std::size_t i = 0; i < spec_.chain.cameras.size(); ++i) {
      const fs::path sensor = folder_ / "mav0" / fmt::format("cam{}", i);
      write_file_atomically(sensor / "data.csv", "#timestamp [ns],filename\n" + lists_[i]);
      if (layout_ != Layout::kEuroc) continue;
      write_file_atomically(sensor / "sensor.yaml", format_sensor(told_.cameras[i], spec_.rate_hz));
    }
  }

  const SequenceSpec& spec_;
  CameraChain told_;
  ImuCalibration true_imu_;
  ImuCalibration told_imu_;
  fs::path folder_;
  Layout layout_;
  std::vector<VideoCompression> compressions_;  ///< Per camera, or none.
  std::vector<std::string> lists_;              ///< Of images, per camera.
  std::string depth_list_;
  std::vector<StampedPose> truth_;
};

}  // namespace

void write_dataset(SimulatedSequence& sequence,
                   const fs::path& folder,
                   const std::function<void(int frame)>& done) {
  Writer writer(sequence.spec(), folder);
  const Rigid3 rig_from_camera0 = sequence.rig().cameras[0].cam_from_rig.inverse();
  for (int i = 0; i < sequence.num_frames(); ++i) {
    const SimulatedFrame frame = sequence.frame(i);
    writer.add(frame, frame.world_from_rig * rig_from_camera0);
    if (done) done(i);
  }
  if (sequence.spec().num_markers > 0) {
    write_file_atomically(folder / "markers.yaml", format_known_markers(sequence.markers()));
  }
  if (sequence.spec().imu) writer.add_imu(sequence.imu_samples());
  writer.finish();
}

}  // namespace waymark
