// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
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
};

/// The pieces of a stream of the camera itself; a drone has streams of its own names.
std::vector<Piece> pieces_of(std::span<const TelemetryPacket> packets, std::string_view key) {
  std::vector<Piece> pieces;
  double num_before = 0.0;
  for (const TelemetryPacket& packet : packets) {
    for (GpmfStream& stream : parse_gpmf(packet.bytes)) {
      if (stream.key != key) continue;
      const auto num_samples = static_cast<double>(stream.num_samples());
      // Counted by the camera, so that a lost packet leaves its gap.
      if (stream.num_total) {
        num_before = std::max(num_before, static_cast<double>(*stream.num_total) - num_samples);
      }
      pieces.push_back({std::move(stream), packet.time_s, packet.duration_s, num_before});
      num_before += num_samples;
    }
  }
  return pieces;
}

/// Time of the first sample and from one to the next, s: a line through the beginnings of packets
/// by least squares, since a packet has a sample more or less, as its end comes.
Eigen::Vector2d fit_times(const std::vector<Piece>& pieces) {
  const auto count = static_cast<Eigen::Index>(pieces.size());
  Eigen::MatrixX2d numbers = Eigen::MatrixX2d::Ones(count + 1, 2);
  Eigen::VectorXd times_s(count + 1);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Piece& piece = pieces[static_cast<std::size_t>(i)];
    numbers(i, 1) = piece.first;
    times_s[i] = piece.time_s;
  }
  // The last packet is as long as the video, not as its samples, but a single one has no other.
  const Piece& last = pieces.back();
  numbers(count, 1) = last.first + static_cast<double>(last.stream.num_samples());
  times_s[count] = last.time_s + last.duration_s;
  const Eigen::Index used = count == 1 ? 2 : count;
  return numbers.topRows(used).colPivHouseholderQr().solve(times_s.head(used));
}

/// What turns the values of a sample into the camera's axes.
Eigen::Matrix3d camera_from_values(const std::string& axes, const std::string& source) {
  Eigen::Matrix3d gopro_from_values = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3 && axes.size() == 3; ++i) {
    const char c = axes[static_cast<std::size_t>(i)];
    const bool is_against = c >= 'x' && c <= 'z';
    const int axis = is_against ? c - 'x' : c - 'X';
    if (axis >= 0 && axis < 3) gopro_from_values(axis, i) = is_against ? -1.0 : 1.0;
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
  const Eigen::Vector2d line = fit_times(pieces);
  const std::string& told = pieces.front().stream.axes;
  const Eigen::Matrix3d turn = camera_from_values(told.empty() ? kUsualAxes : told, source);
  for (const Piece& piece : pieces) {
    const std::vector<double>& values = piece.stream.values;
    for (std::size_t k = 0; k < piece.stream.num_samples(); ++k) {
      constexpr double kMaxSeconds = 1e9;
      const double time_s = line[0] + line[1] * (piece.first + static_cast<double>(k));
      if (piece.stream.num_values != 3 || !(std::abs(time_s) < kMaxSeconds)) continue;
      const Eigen::Vector3d value(values[3 * k], values[3 * k + 1], values[3 * k + 2]);
      if (!value.allFinite() || readings.size() == kMaxImuSamples) continue;
      readings.push_back({std::llround(1e9 * time_s), turn * value});
    }
  }
  return readings;
}

/// Quaternions of a stream, of which there is one per image, w first: camera_from_start (CORI) or
/// image_from_camera (IORI), in axes of the camera.
std::vector<StampedRotation> read_rotations(std::span<const TelemetryPacket> packets,
                                            std::string_view key) {
  std::vector<StampedRotation> rotations;
  const std::vector<Piece> pieces = pieces_of(packets, key);
  if (pieces.empty()) return rotations;
  const Eigen::Vector2d line = fit_times(pieces);
  for (const Piece& piece : pieces) {
    for (std::size_t k = 0; k < piece.stream.num_samples(); ++k) {
      const double time_s = line[0] + line[1] * (piece.first + static_cast<double>(k));
      const double* values = &piece.stream.values[k * piece.stream.num_values];
      constexpr double kMaxSeconds = 1e9;
      if (piece.stream.num_values != 4 || !(std::abs(time_s) < kMaxSeconds)) continue;
      const Eigen::Quaterniond rotation(values[0], values[1], values[2], values[3]);
      if (!(std::abs(rotation.norm() - 1.0) < 0.01) || rotations.size() == kMaxImuSamples) continue;
      const std::int64_t time_ns = std::llround(1e9 * time_s);
      if (!rotations.empty() && time_ns <= rotations.back().timestamp_ns) continue;
      rotations.push_back({time_ns, rotation.normalized()});
    }
  }
  return rotations;
}

/// A video that the camera stabilised: images were turned against it.
void follow_stabilization(std::span<const TelemetryPacket> packets, ImuStream& stream) {
  constexpr double kHalfDegree = 0.009;
  const std::vector<StampedRotation> images = read_rotations(packets, "IORI");
  const bool is_stabilized = std::ranges::any_of(images, [](const StampedRotation& image) {
    return image.rotation.angularDistance(Eigen::Quaterniond::Identity()) > kHalfDegree;
  });
  if (!is_stabilized) return;
  const bool is_turned = turn_with_images(read_rotations(packets, "CORI"), images, stream.samples);
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

std::optional<ImuStream> imu_of_gopro(std::span<const TelemetryPacket> packets,
                                      const std::string& source) {
  const std::vector<Piece> pieces = pieces_of(packets, "GYRO");
  const std::vector<SensorReading> gyroscope = read_sensor(pieces, source);
  std::vector<SensorReading> accelerometer = read_sensor(pieces_of(packets, "ACCL"), source);
  if (gyroscope.size() < 2 || accelerometer.size() < 2) return std::nullopt;
  ImuStream stream = merge_imu(gyroscope, std::move(accelerometer), source);
  const auto& [device, axes] = std::pair(pieces[0].stream.device, pieces[0].stream.axes);
  stream.notes = {
      fmt::format("telemetry of {} (GPMF): rad/s, m/s^2",
                  device.empty() ? "a GoPro" : printable(device)),
      fmt::format("axes {} turned into x right, y down, z forward of the camera",
                  axes.empty() ? fmt::format("{} (assumed)", kUsualAxes) : printable(axes))};
  follow_stabilization(packets, stream);
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
    // Bounded, as the container may state anything.
    constexpr double kMaxFileSeconds = 1e6;
    if (file.rate_hz() > 0.0) {
      start_s += std::min(kMaxFileSeconds, file.num_frames() / file.rate_hz());
    }
    source += (source.empty() ? "" : " and ") + path.string();
  }
  return imu_of_gopro(packets, source);
}

}  // namespace waymark
