// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/gopro_imu.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/gpmf.h"
#include "waymark/input/imu_merge.h"
#include "waymark/input/listing.h"

namespace waymark {
namespace {

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
      if (stream.key != key || stream.num_samples() == 0) continue;
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

/// A line of times by the number of the sample.
struct TimeLine {
  double start_s = 0.0;
  double step_s = 0.0;
};

/// Through the beginnings of packets, by least squares: a packet has a sample more or less, as its
/// end comes.
TimeLine fit_times(const std::vector<Piece>& pieces) {
  const Piece& last = pieces.back();
  const auto num_in_last = static_cast<double>(last.stream.num_samples());
  double count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  const auto add = [&](double index, double time_s) {
    count += 1.0;
    x += index;
    y += time_s;
    xx += index * index;
    xy += index * time_s;
  };
  for (const Piece& piece : pieces) add(piece.first, piece.time_s);
  // The last packet is as long as the video, not as its samples.
  if (pieces.size() == 1) add(last.first + num_in_last, last.time_s + last.duration_s);
  const double spread = count * xx - x * x;
  if (spread <= 0.0) return {last.time_s, 0.0};
  const double step_s = (count * xy - x * y) / spread;
  return {(y - step_s * x) / count, step_s};
}

/// Of the camera's clock, at the first image: that of a stream with a sample per image.
std::optional<double> first_image_stamp_s(std::span<const TelemetryPacket> packets) {
  for (const std::string_view key : {"CORI", "SHUT"}) {
    const std::vector<Piece> pieces =
        pieces_of(packets.first(std::min<std::size_t>(packets.size(), 1)), key);
    if (pieces.empty() || !pieces.front().stream.stamp_us) continue;
    return 1e-6 * static_cast<double>(*pieces.front().stream.stamp_us);
  }
  return std::nullopt;
}

/// Seconds since the first image, of each sample; nothing where they are no times.
std::vector<double> times_of(const std::vector<Piece>& pieces,
                             std::optional<double> image_stamp_s) {
  std::vector<double> times_s;
  const bool has_stamps = std::ranges::all_of(
      pieces, [](const Piece& piece) { return piece.stream.stamp_us.has_value(); });
  const TimeLine line = fit_times(pieces);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    double start_s = line.start_s + line.step_s * piece.first;
    double step_s = line.step_s;
    if (has_stamps && image_stamp_s) {
      const auto stamp_s = [](const Piece& of) {
        return 1e-6 * static_cast<double>(*of.stream.stamp_us);
      };
      start_s = stamp_s(piece) - *image_stamp_s;
      const bool has_next = i + 1 < pieces.size() && pieces[i + 1].first > piece.first;
      if (has_next) {
        step_s = (stamp_s(pieces[i + 1]) - stamp_s(piece)) / (pieces[i + 1].first - piece.first);
      }
    }
    for (std::size_t k = 0; k < piece.stream.num_samples(); ++k) {
      times_s.push_back(start_s + step_s * static_cast<double>(k));
    }
  }
  return times_s;
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

std::vector<SensorReading> read_sensor(std::span<const TelemetryPacket> packets,
                                       std::string_view key,
                                       const std::string& source) {
  std::vector<SensorReading> readings;
  const std::vector<Piece> pieces = pieces_of(packets, key);
  if (pieces.empty()) return readings;
  const std::vector<double> times_s = times_of(pieces, first_image_stamp_s(packets));
  const std::string& told = pieces.front().stream.axes;
  const Eigen::Matrix3d turn = camera_from_values(told.empty() ? kUsualAxes : told, source);
  std::size_t n = 0;
  for (const Piece& piece : pieces) {
    const std::vector<double>& values = piece.stream.values;
    for (std::size_t k = 0; k < piece.stream.num_samples(); ++k, ++n) {
      constexpr double kMaxSeconds = 1e9;
      if (piece.stream.num_values != 3 || !(std::abs(times_s[n]) < kMaxSeconds)) continue;
      const Eigen::Vector3d value(values[3 * k], values[3 * k + 1], values[3 * k + 2]);
      if (!value.allFinite() || readings.size() == kMaxImuSamples) continue;
      readings.push_back({std::llround(1e9 * times_s[n]), turn * value});
    }
  }
  return readings;
}

/// Whether images were turned against the camera (IORI), as those of a stabilised video are.
bool is_stabilized(std::span<const TelemetryPacket> packets) {
  constexpr double kCosHalfDegree = 0.99996;
  for (const Piece& piece : pieces_of(packets, "IORI")) {
    for (std::size_t k = 0; k < piece.stream.num_samples(); ++k) {
      const double cosine = piece.stream.values[k * piece.stream.num_values];
      if (std::abs(cosine) < kCosHalfDegree) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<ImuStream> imu_of_gopro(std::span<const TelemetryPacket> packets,
                                      const std::string& source) {
  const std::vector<SensorReading> gyroscope = read_sensor(packets, "GYRO", source);
  std::vector<SensorReading> accelerometer = read_sensor(packets, "ACCL", source);
  if (gyroscope.size() < 2 || accelerometer.size() < 2) return std::nullopt;
  ImuStream stream;
  stream.source = source;
  stream.samples = merge_imu(gyroscope, std::move(accelerometer));
  const GpmfStream first = pieces_of(packets, "GYRO").front().stream;
  stream.notes = {fmt::format("telemetry of {} (GPMF): rad/s, m/s^2",
                              first.device.empty() ? "a GoPro" : printable(first.device)),
                  fmt::format("axes {} turned into x right, y down, z forward of the camera",
                              first.axes.empty() ? fmt::format("{} (assumed)", kUsualAxes)
                                                 : printable(first.axes))};
  if (is_stabilized(packets)) {
    stream.notes.emplace_back(
        "note: the video is stabilised: its images do not turn as the camera did");
  }
  sort_samples(stream);
  return stream;
}

std::optional<ImuStream> imu_of_videos(const std::vector<std::filesystem::path>& files) {
  std::optional<ImuStream> whole;
  double start_s = 0.0;
  for (const std::filesystem::path& path : files) {
    if (is_address(path)) return std::nullopt;
    const VideoFile file(path);
    if (!file.has_telemetry()) return std::nullopt;
    std::optional<ImuStream> part = imu_of_gopro(read_telemetry(path), path.string());
    if (!part) return std::nullopt;
    for (ImuSample& sample : part->samples) sample.timestamp_ns += std::llround(1e9 * start_s);
    // Bounded, as the container may state anything.
    constexpr double kMaxFileSeconds = 1e6;
    if (file.rate_hz() > 0.0) {
      start_s += std::min(kMaxFileSeconds, file.num_frames() / file.rate_hz());
    }
    if (!whole) {
      whole = std::move(part);
      continue;
    }
    whole->samples.insert(whole->samples.end(), part->samples.begin(), part->samples.end());
    whole->source += " and " + part->source;
  }
  if (whole) sort_samples(*whole);
  return whole;
}

}  // namespace waymark
