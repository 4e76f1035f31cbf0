// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/imu/imu_health.h"
#include "waymark/imu/start_steps.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/listing.h"

namespace waymark {
namespace {

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<unsigned char>(byte);
  return value;
}

/// Nothing of types that no sensor has.
std::vector<double> numbers_of(char type, std::string_view data) {
  const bool is_short = type == 's' || type == 'S';
  const bool is_long = type == 'l' || type == 'L' || type == 'f';
  const std::size_t size = is_short ? 2 : 4;
  std::vector<double> numbers;
  for (std::size_t at = 0; (is_short || is_long) && at + size <= data.size(); at += size) {
    const auto bits = static_cast<std::uint32_t>(big_endian(data.substr(at, size)));
    numbers.push_back(type == 's'   ? static_cast<std::int16_t>(bits)
                      : type == 'l' ? static_cast<std::int32_t>(bits)
                      : type == 'f' ? std::bit_cast<float>(bits)
                                    : static_cast<double>(bits));
  }
  return numbers;
}

/// Of the models that do not tell theirs, HERO5 on: "Accelerometer (up/down, right/left,
/// forward/back)", "Gyroscope (z,x,y)".
constexpr const char* kUsualAxes = "ZXY";

/// One stream in one packet.
struct Piece {
  GpmfStream stream;
  double time_s = 0.0;      ///< Of the packet.
  double duration_s = 0.0;  ///< The same.
  double first = 0.0;       ///< How many samples were before it.
  double end() const { return first + static_cast<double>(stream.num_samples()); }
};

/// The streams of the camera itself by their keys; a drone has streams of its own names.
using Pieces = std::map<std::string, std::vector<Piece>>;

Pieces pieces_of(std::span<const TelemetryPacket> packets) {
  Pieces pieces;
  for (const TelemetryPacket& packet : packets) {
    for (GpmfStream& stream : parse_gpmf(packet.bytes)) {
      std::vector<Piece>& same = pieces[stream.key];
      double first = same.empty() ? 0.0 : same.back().end();
      // Counted by the camera, so that a lost packet leaves its gap.
      if (stream.num_total) {
        const auto num_samples = static_cast<double>(stream.num_samples());
        first = std::max(first, static_cast<double>(*stream.num_total) - num_samples);
      }
      same.push_back({std::move(stream), packet.time_s, packet.duration_s, first});
    }
  }
  return pieces;
}

/// Time of the first sample and from one to the next, s: a line through the beginnings of packets
/// by least squares, since a packet has a sample more or less, as its end comes.
Eigen::Vector2d fit_times(const std::vector<Piece>& pieces) {
  const Piece& last = pieces.back();
  // The last packet is as long as the video, not as its samples, but a single one has no other.
  const double period_s = last.duration_s / static_cast<double>(last.stream.num_samples());
  if (pieces.size() == 1) return {last.time_s - last.first * period_s, period_s};
  const auto count = static_cast<Eigen::Index>(pieces.size());
  Eigen::MatrixX2d numbers = Eigen::MatrixX2d::Ones(count, 2);
  Eigen::VectorXd times_s(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    numbers(i, 1) = pieces[static_cast<std::size_t>(i)].first;
    times_s[i] = pieces[static_cast<std::size_t>(i)].time_s;
  }
  return numbers.colPivHouseholderQr().solve(times_s);
}

/// Calls visit(time_ns, values) for each sample of so many values.
template <class Visit>
void for_each_sample(const std::vector<Piece>& pieces, std::size_t num_values, const Visit& visit) {
  if (pieces.empty()) return;
  const Eigen::Vector2d line = fit_times(pieces);
  for (const Piece& piece : pieces) {
    if (piece.stream.num_values != num_values) continue;
    for (std::size_t k = 0; k < piece.stream.num_samples(); ++k) {
      constexpr double kMaxSeconds = 1e9;
      const double time_s = line[0] + line[1] * (piece.first + static_cast<double>(k));
      if (!(std::abs(time_s) < kMaxSeconds)) continue;
      visit(std::llround(1e9 * time_s), &piece.stream.values[k * num_values]);
    }
  }
}

/// What turns the values of a sample into the camera's axes.
Eigen::Matrix3d camera_from_values(const std::string& axes, const std::string& source) {
  Eigen::Matrix3d gopro_from_values = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3 && axes.size() == 3; ++i) {
    const std::size_t axis = std::string_view("XYZxyz").find(axes[static_cast<std::size_t>(i)]);
    if (axis < 6) gopro_from_values(static_cast<int>(axis % 3), i) = axis < 3 ? 1.0 : -1.0;
  }
  if (std::abs(gopro_from_values.determinant() - 1.0) > 0.5) {
    throw InputError(source,
                     fmt::format("has axes {}, expected those of a right-handed frame, such as {}",
                                 quote_for_message(axes),
                                 kUsualAxes));
  }
  // X points left, Y back and Z up: measured, with the turns of images and with gravity.
  Eigen::Matrix3d camera_from_gopro;
  camera_from_gopro << -1, 0, 0, 0, 0, -1, 0, -1, 0;
  return camera_from_gopro * gopro_from_values;
}

std::vector<SensorReading> read_sensor(const std::vector<Piece>& pieces,
                                       const std::string& source) {
  std::vector<SensorReading> readings;
  if (pieces.empty()) return readings;
  const std::string& told = pieces.front().stream.axes;
  const Eigen::Matrix3d turn = camera_from_values(told.empty() ? kUsualAxes : told, source);
  for_each_sample(pieces, 3, [&](std::int64_t time_ns, const double* values) {
    const Eigen::Vector3d value(values);
    if (value.allFinite()) readings.push_back({time_ns, turn * value});
  });
  return readings;
}

/// Quaternions of a stream, of which there is one per image, w first: camera_from_start (CORI) or
/// image_from_camera (IORI), in axes of the camera.
std::vector<StampedRotation> read_rotations(const std::vector<Piece>& pieces) {
  std::vector<StampedRotation> rotations;
  for_each_sample(pieces, 4, [&](std::int64_t time_ns, const double* values) {
    const Eigen::Quaterniond rotation(values[0], values[1], values[2], values[3]);
    const bool is_later = rotations.empty() || time_ns > rotations.back().timestamp_ns;
    const bool is_rotation = std::abs(rotation.norm() - 1.0) < 0.01;
    if (is_later && is_rotation) rotations.push_back({time_ns, rotation.normalized()});
  });
  return rotations;
}

/// By how much the clock of the samples is ahead of that of the images; nothing where orientations
/// turn otherwise.
std::optional<std::int64_t> clock_offset(const std::vector<StampedRotation>& camera_from_start,
                                         const std::vector<ImuSample>& samples) {
  constexpr double kClockSigmaS = 0.03;
  constexpr double kMaxAngle = 0.3;
  ImuSamples gyroscope;
  for (const ImuSample& sample : samples) gyroscope.add(sample);
  std::vector<VisionPose> poses;
  for (const StampedRotation& camera : camera_from_start) {
    poses.push_back({camera.timestamp_ns, Rigid3(camera.rotation, Eigen::Vector3d::Zero())});
  }
  const InertialStartOptions options{.time_shift_sigma_s = kClockSigmaS};
  const ImuCalibration nothing;
  const ImuNoise noise = default_imu_noise();
  const auto start = rotation_start({gyroscope, poses, nothing, noise, options});
  const auto upright = Eigen::Quaterniond::Identity();
  if (!start || start->imu_from_rig.angularDistance(upright) > kMaxAngle) return std::nullopt;
  return std::llround(1e9 * start->time_shift_s);
}

/// What was measured in axes of the camera, in those of an image that is turned against it.
ImuSample seen_from_image(const ImuSample& sample,
                          const StampedRotation& before,
                          const StampedRotation& after) {
  const auto period_ns = static_cast<double>(after.timestamp_ns - before.timestamp_ns);
  const double part = static_cast<double>(sample.timestamp_ns - before.timestamp_ns) / period_ns;
  const Eigen::Vector3d turn = so3_log(after.rotation * before.rotation.conjugate());
  const Eigen::Quaterniond image_from_camera = so3_exp(part * turn) * before.rotation;
  return {sample.timestamp_ns,
          image_from_camera * sample.angular_velocity - turn / (1e-9 * period_ns),
          image_from_camera * sample.acceleration};
}

/// A video that the camera stabilised: images were turned against it.
void follow_stabilization(Pieces& pieces, ImuStream& stream) {
  constexpr double kHalfDegree = 0.009;
  const std::vector<StampedRotation> images = read_rotations(pieces["IORI"]);
  const bool is_stabilized = std::ranges::any_of(images, [](const StampedRotation& image) {
    return image.rotation.angularDistance(Eigen::Quaterniond::Identity()) > kHalfDegree;
  });
  if (!is_stabilized) return;
  const bool is_turned = turn_with_images(read_rotations(pieces["CORI"]), images, stream.samples);
  stream.notes.emplace_back(
      is_turned ? "the video is stabilised: samples are turned as its images are"
                : "note: the video is stabilised: its images do not turn as the camera did");
}

}  // namespace

// Key, length, value: four letters, a type, the bytes of a sample, the number of samples (16 bits,
// most significant byte first as all numbers), and these, filled up to whole 4 bytes. What holds
// others has no type: they follow its head, so that all are read one after the other.
std::vector<GpmfStream> parse_gpmf(std::string_view payload) {
  constexpr std::size_t kHead = 8;
  std::vector<GpmfStream> streams;
  GpmfStream stream;
  std::vector<double> scales;
  while (payload.size() >= kHead) {
    const std::string_view key = payload.substr(0, 4);
    const char type = payload[4];
    const std::size_t sample_size = static_cast<unsigned char>(payload[5]);
    const std::uint64_t num_samples = big_endian(payload.substr(6, 2));
    payload.remove_prefix(kHead);
    if (key == "STRM" || key == "DEVC") {
      const std::string device = key == "STRM" ? stream.device : "";
      stream = GpmfStream();
      stream.device = device;
      scales.clear();
    }
    if (type == 0) continue;
    const std::size_t size = sample_size * num_samples;
    if (size > payload.size()) break;
    const std::string_view data = payload.substr(0, size);
    payload.remove_prefix(std::min(payload.size(), (size + 3) / 4 * 4));
    const std::string text(data.substr(0, data.find('\0')));
    if (key == "DVNM") stream.device = text;
    if (key == "ORIN") stream.axes = text;
    if (key == "SCAL") scales = numbers_of(type, data);
    if (key == "TSMP") stream.num_total = big_endian(data.substr(0, 8));
    if (key != "ACCL" && key != "GYRO" && key != "GRAV" && key != "CORI" && key != "IORI") {
      continue;
    }
    stream.key = key;
    stream.values = numbers_of(type, data);
    if (stream.values.empty()) continue;
    stream.num_values = std::max<std::size_t>(1, stream.values.size() / num_samples);
    for (std::size_t i = 0; i < stream.values.size() && !scales.empty(); ++i) {
      const double scale = scales[std::min(i % stream.num_values, scales.size() - 1)];
      if (scale != 0.0) stream.values[i] /= scale;
    }
    streams.push_back(stream);
  }
  return streams;
}

bool turn_with_images(const std::vector<StampedRotation>& camera_from_start,
                      const std::vector<StampedRotation>& image_from_camera,
                      std::vector<ImuSample>& samples) {
  const auto offset_ns = clock_offset(camera_from_start, samples);
  if (!offset_ns || image_from_camera.size() < 2) return false;
  std::vector<ImuSample> turned;
  for (ImuSample sample : samples) {
    sample.timestamp_ns -= *offset_ns;
    const auto after = std::ranges::upper_bound(
        image_from_camera, sample.timestamp_ns, {}, &StampedRotation::timestamp_ns);
    if (after == image_from_camera.begin() || after == image_from_camera.end()) continue;
    turned.push_back(seen_from_image(sample, *(after - 1), *after));
  }
  samples = std::move(turned);
  return true;
}

std::optional<ImuStream> imu_of_gopro(std::span<const TelemetryPacket> packets,
                                      const std::string& source) {
  Pieces pieces = pieces_of(packets);
  const std::vector<SensorReading> gyroscope = read_sensor(pieces["GYRO"], source);
  std::vector<SensorReading> accelerometer = read_sensor(pieces["ACCL"], source);
  if (gyroscope.size() < 2 || accelerometer.size() < 2) return std::nullopt;
  ImuStream stream = merge_imu(gyroscope, std::move(accelerometer), source);
  const GpmfStream& told = pieces["GYRO"].front().stream;
  stream.notes = {fmt::format("telemetry of {} (GPMF): rad/s, m/s^2",
                              told.device.empty() ? "a GoPro" : printable(told.device)),
                  fmt::format("axes {} turned into x right, y down, z forward of the camera",
                              told.axes.empty() ? fmt::format("{} (assumed)", kUsualAxes)
                                                : printable(told.axes))};
  follow_stabilization(pieces, stream);
  if (stream.samples.size() < 2) return std::nullopt;
  return stream;
}

std::optional<ImuStream> imu_of_videos(const std::vector<std::filesystem::path>& files) {
  std::vector<TelemetryPacket> packets;
  std::string source;
  double start_s = 0.0;
  for (const std::filesystem::path& path : files) {
    if (is_address(path)) return std::nullopt;
    std::vector<TelemetryPacket> part = read_telemetry(path);
    if (part.empty()) return std::nullopt;
    for (TelemetryPacket& packet : part) {
      packet.time_s += start_s;
      packets.push_back(std::move(packet));
    }
    const VideoFile file(path);
    if (file.rate_hz() > 0.0) start_s += file.num_frames() / file.rate_hz();
    source += (source.empty() ? "" : " and ") + path.string();
  }
  return imu_of_gopro(packets, source);
}

}  // namespace waymark
