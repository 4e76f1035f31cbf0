// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What reads inertial data, and what is known of an IMU.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/bag/bag.h"
#include "waymark/base/config.h"
#include "waymark/imu/imu.h"
#include "waymark/input/imu_stream.h"
#include "waymark/input/input.h"
#include "waymark/input/video_file.h"

namespace waymark {

/// What one sensor of three axes measured at one moment.
struct SensorReading {
  std::int64_t timestamp_ns = 0;
  Eigen::Vector3d value;  ///< rad/s or m/s^2.
};

/// A stream at the times of the gyroscope, increasing, with the acceleration interpolated linearly,
/// but across no gap (see ImuSamples). Throws InputError at `source` for fewer than two samples.
ImuStream merge_imu(const std::vector<SensorReading>& gyroscope,
                    std::vector<SensorReading> accelerometer,
                    const std::string& source);

/// Inertial data as they come, in SI units and in the order of rows or messages.
struct ImuTable {
  std::vector<SensorReading> gyroscope;      ///< rad/s; empty: the table has none.
  std::vector<SensorReading> accelerometer;  ///< m/s^2; the same.
  std::set<std::string> notes;               ///< Units as understood, for people.
};

/// Parses a table with a row per moment, with or without a header. Times are in the unit with 10 to
/// 5000 rows a second; turns in that of the header, else rad/s unless they are too fast for that;
/// whether accelerations are in m/s^2 or g tells their middle length, gravity's. A last row without
/// an end of line was cut off and is left out. name: of the file, for errors and for what plain x,
/// y and z are of. Throws InputError.
ImuTable parse_imu_table(std::string_view text, const std::string& name);

/// Reads a table of an IMU; one of a single sensor with that of the other beside it, which has the
/// same name but for the sensor. Throws InputError.
ImuStream read_imu_file(const std::filesystem::path& path);

/// The inertial data of a EuRoC data set: mav0/imu0/data.csv, with what sensor.yaml beside it and
/// of camera 0, or dso/camchain.yaml and dso/imu_config.yaml, say; nothing without that table.
/// Throws InputError.
std::optional<ImuStream> read_euroc_imu(const std::filesystem::path& folder);

/// The inertial data of a bag: of the topics of sensor_msgs/Imu the one with the most turns and
/// accelerations, else one of turns with one of accelerations (RealSense's driver). Nothing where
/// there is none. time_of: of a message. Throws InputError.
std::optional<ImuStream> imu_of_bag(const Bag& bag,
                                    const std::function<std::int64_t(const BagMessage&)>& time_of);

/// How something was turned at one moment.
struct StampedRotation {
  std::int64_t timestamp_ns = 0;
  Eigen::Quaterniond rotation;
};

/// Makes samples in axes of the camera those of an IMU that turns with its stabilised images, by
/// the clock of these, which the orientations have, too. All are in the order of time. False, and
/// nothing is changed, where the camera's orientations do not turn as the gyroscope does.
bool turn_with_images(const std::vector<StampedRotation>& camera_from_start,
                      const std::vector<StampedRotation>& image_from_camera,
                      std::vector<ImuSample>& samples);

/// Measurements of one kind, in one payload of GPMF, the telemetry of GoPro cameras.
struct GpmfStream {
  std::string key;             ///< "ACCL", "GYRO", "GRAV", "CORI", "IORI".
  std::string device;          ///< The model (DVNM).
  std::size_t num_values = 1;  ///< Of a sample.
  std::vector<double> values;  ///< Scaled (SCAL), sample after sample.
  /// Which axis each value is of, "XzY": small letters point against it (ORIN); empty: not told.
  std::string axes;
  std::optional<std::uint64_t> num_total;  ///< Samples up to the end of the payload (TSMP).

  std::size_t num_samples() const { return values.size() / num_values; }
};

/// The streams ACCL, GYRO, GRAV, CORI and IORI of a payload, of numbers of 16 or 32 bits, with what
/// is said of them before. What is cut off or malformed ends it: what came before is given.
std::vector<GpmfStream> parse_gpmf(std::string_view payload);

/// The IMU of a GoPro camera, of the packets of a file's telemetry (GPMF); nothing where they have
/// none. Axes are those of the camera held upright: x right, y down, z forward. Times are those of
/// the file, which begins with its first image. Of a stabilised video they are those of the images.
/// Throws InputError at `source` for axes that make no frame.
std::optional<ImuStream> imu_of_gopro(std::span<const TelemetryPacket> packets,
                                      const std::string& source);

/// The same of the files of a video, which follow each other; nothing where one has none. Throws
/// InputError.
std::optional<ImuStream> imu_of_videos(const std::vector<std::filesystem::path>& files);

/// What a document in Kalibr's format says of the IMU: T_cam_imu and timeshift_cam_imu of cam0, and
/// of the section imu0 the noise, all four numbers or none, and scale and misalignment of the
/// sensors. Throws InputError.
ImuCalibration read_imu_calibration(const ConfigNode& config);

/// What `calibration` does not tell, as `other` has it.
void fill_in(ImuCalibration& calibration, const ImuCalibration& other);

/// Gives an input its inertial data, with a line on them: those of InputOptions::imu, else what
/// `carried` reads, if any. What the options say of the IMU takes the place of what these know.
/// Samples are corrected by the intrinsics. Throws InputError for a file of the options; what the
/// input carries and cannot be read is said and left out, as no input needs it.
void take_imu(const InputOptions& options,
              const std::function<std::optional<ImuStream>()>& carried,
              InputInfo& info);

/// Of images that are turned clockwise by so many quarters: so is camera 0, the rig's frame.
void turn_imu(InputInfo& info, int num_quarters);

}  // namespace waymark
