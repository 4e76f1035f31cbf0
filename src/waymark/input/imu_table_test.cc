// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Tables as data sets and recorders of phones write them, cut down to a few rows.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;

/// A header and ten rows 5 ms apart; {t} is the time in that unit, others stay.
std::string table(const std::string& header,
                  const std::string& row,
                  long double first,
                  long double step) {
  std::string text = header.empty() ? "" : header + "\n";
  for (int i = 0; i < 10; ++i) {
    std::string line = row;
    line.replace(
        line.find("{t}"), 3, fmt::format("{:.3f}", first + step * static_cast<long double>(i)));
    text += line + "\n";
  }
  return text;
}

/// That a table is of turns 1, 2, 3 rad/s and accelerations 0, 0, 9.80665 m/s^2, 5 ms apart.
void expect_both(const std::string& text,
                 std::int64_t first_ns,
                 const std::string& name = "a.csv") {
  const ImuTable read = parse_imu_table(text, name);
  ASSERT_EQ(read.gyroscope.size(), 10U) << text;
  ASSERT_EQ(read.accelerometer.size(), 10U) << text;
  EXPECT_EQ(read.gyroscope[0].timestamp_ns, first_ns);
  EXPECT_EQ(read.gyroscope[9].timestamp_ns, first_ns + 45'000'000);
  EXPECT_LT((read.gyroscope[3].value - Eigen::Vector3d(1, 2, 3)).norm(), 1e-5) << text;
  EXPECT_LT((read.accelerometer[3].value - Eigen::Vector3d(0, 0, 9.80665)).norm(), 1e-5) << text;
}

TEST(ImuTable, ReadsTablesOfDataSets) {
  const std::int64_t start_ns = 1'403'636'580'000'000'000;
  const long double start = 1.40363658e18L;
  const char* euroc =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m "
      "s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]";
  expect_both(table(euroc, "{t},1,2,3,0,0,9.80665", start, 5e6), start_ns);
  expect_both(table("", "{t},1,2,3,0,0,9.80665", start, 5e6), start_ns);
  expect_both(table("", "{t} 0 0 9.80665 1 2 3", 1403636580.0, 0.005), start_ns);
  const char* ros =
      "%time,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity."
      "z,field.linear_acceleration.x,field.linear_acceleration.y,field.linear_"
      "acceleration.z";
  expect_both(table(ros, "{t},1,2,3,0,0,9.80665", start, 5e6), start_ns);
}

TEST(ImuTable, ReadsTablesOfPhones) {
  expect_both(table("Timestamp[nanosec], gx[rad/s], gy[rad/s], gz[rad/s], ax[m/s^2], ay[m/s^2], "
                    "az[m/s^2], Unix time[nanosec]",
                    "{t}, 1, 2, 3, 0, 0, 9.80665, 1600000000000000000",
                    7e12,
                    5e6),
              7'000'000'000'000);
  expect_both(table("time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz", "{t},0,0,1,0,0,0,1,2,3", 2.0, 0.005),
              2'000'000'000);
  expect_both(table("\"Time (ms)\";\"Acceleration x (m/s^2)\";\"Acceleration y (m/s^2)\";"
                    "\"Acceleration z (m/s^2)\";\"Absolute acceleration (m/s^2)\";"
                    "\"Gyroscope x (deg/s)\";\"Gyroscope y (deg/s)\";\"Gyroscope z (deg/s)\"",
                    "{t};0;0;9.80665;9.8;57.2957795;114.591559;171.887339",
                    100,
                    5),
              100'000'000);
  expect_both(table("loggingTime(txt),loggingSample(N),accelerometerTimestamp_sinceReboot(s),"
                    "accelerometerAccelerationX(G),accelerometerAccelerationY(G),"
                    "accelerometerAccelerationZ(G),gyroRotationX(rad/s),gyroRotationY(rad/s),"
                    "gyroRotationZ(rad/s)",
                    "2024-01-01,5,{t},0,0,-1,1,2,3",
                    5.0,
                    0.005),
              5'000'000'000);
  expect_both(table("", "{t},57.2957795,114.591559,171.887339,0,0,9.80665", 3'000'000, 5'000),
              3'000'000'000);
}

TEST(ImuTable, ReadsRowsOfOneSensorEach) {
  std::string blank = "time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z\n";
  for (int i = 0; i < 10; ++i) {
    blank += fmt::format("{0},1,2,3,,,\n{0},,,,0,0,9.80665\n", 0.005 * i);
  }
  expect_both(blank, 0);
}

TEST(ImuTable, BringsTwoTablesTogether) {
  const TemporaryFolder folder;
  folder.write("Accelerometer.csv", table("time,seconds_elapsed,z,y,x", "{t},0,0,0,0", 1e18, 5e6));
  folder.write("TotalAcceleration.csv",
               table("time,seconds_elapsed,z,y,x", "{t},0,9.8,0.2,0.1", 1e18 - 1e6, 1e7));
  folder.write("Gyroscope.csv", table("time,seconds_elapsed,z,y,x", "{t},0,3,2,1", 1e18, 5e6));
  folder.write("GyroscopeUncalibrated.csv", "unread");
  for (const char* name : {"Gyroscope.csv", "TotalAcceleration.csv"}) {
    const ImuStream stream = read_imu_file(folder / name);
    EXPECT_THAT(stream.source, HasSubstr("TotalAcceleration.csv"));
    ASSERT_EQ(stream.samples.size(), 10U) << name;
    EXPECT_EQ(stream.samples[0].angular_velocity, Eigen::Vector3d(1, 2, 3));
    EXPECT_LT((stream.samples[5].acceleration - Eigen::Vector3d(0.1, 0.2, 9.8)).norm(), 1e-9);
    EXPECT_THAT(stream.notes, Contains(HasSubstr("interpolated")));
  }
  EXPECT_THAT(fault_of(read_imu_file(folder / "Accelerometer.csv")),
              HasSubstr("a mean length of 0, expected gravity in them, 9.8 m/s^2 or 1 g"));
}

TEST(ImuTable, ReadsTablesWithoutHeaderByTheirNames) {
  const TemporaryFolder folder;
  folder.write("VID_1_accel.csv", table("", "0,0,9.8,{t}", 1e12, 5e6));
  folder.write("VID_1_gyro.csv", table("", "1,2,3,{t}", 1e12, 5e6));
  folder.write("VID_2_gyro.csv", table("", "1,2,3,{t}", 1e12, 5e6));
  const ImuStream stream = read_imu_file(folder / "VID_1_gyro.csv");
  ASSERT_EQ(stream.samples.size(), 10U);
  EXPECT_EQ(stream.samples[2].angular_velocity, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(stream.samples[2].acceleration, Eigen::Vector3d(0, 0, 9.8));
  EXPECT_THAT(input_error_of([&] { read_imu_file(folder / "VID_2_gyro.csv"); }),
              HasSubstr("VID_2_gyro.csv: is of one sensor, expected that of the other beside it"));
}

TEST(ImuTable, TakesMixedRecordingsAsTheyAre) {
  std::string text = "#timestamp,w_x,w_y,w_z,a_x,a_y,a_z\n";
  for (int i = 0; i < 100; ++i) {
    const int late_ms = i % 3 == 0 ? 0 : 355;
    text += fmt::format("{},0,0,0,0,0,{}\n", (5 * i + late_ms) * 1'000'000LL, 9.8);
  }
  const TemporaryFolder folder;
  folder.write("imu0.csv", text);
  const ImuStream stream = read_imu_file(folder / "imu0.csv");
  EXPECT_EQ(stream.samples.size() + stream.num_doubles, 100U);
  EXPECT_EQ(stream.num_out_of_order, 33U);
}

TEST(ImuTable, SaysWhatIsWrong) {
  const auto error_of = [](const std::string& text) {
    return input_error_of([&] { parse_imu_table(text, "a.csv"); });
  };
  EXPECT_THAT(error_of(""), HasSubstr("a.csv: empty, expected columns of a time"));
  EXPECT_THAT(error_of("time,wx,wy,wz\n"), HasSubstr("has no rows"));
  EXPECT_THAT(error_of("a,b\n1,2\n3,4\n"), HasSubstr("has 1 column, expected"));
  EXPECT_THAT(error_of("a,b,c,d\n1,2,3,4\n"), HasSubstr("names no time"));
  EXPECT_THAT(error_of("time,b,c,d\n1,2,3,4\n1.005,1,1,1\n"), HasSubstr("names no sensor"));
  EXPECT_THAT(error_of(table("t,wx,wy,wz", "{t},0,0,1", 0, 5e10)),
              HasSubstr("expected 10 to 5000 rows a second"));
  EXPECT_THAT(error_of("t,wx,wy,wz\n0,1,2,3\n0.01,1,x,3\n0.02,1,2,3\n"),
              HasSubstr("a.csv:3: field 3"));
  EXPECT_THAT(error_of("t,wx,wy,wz\n-1,1,2,3\n-0.99,1,1,3\n-0.98,1,2,3\n"),
              HasSubstr("expected a time in s from 0 on"));
  EXPECT_EQ(parse_imu_table("t,wx,wy,wz\n0,1,2,3\n0.01,1,2,3\n0.02,1", "a.csv").gyroscope.size(),
            2U)
      << "the recorder was switched off";
  const TemporaryFolder folder;
  EXPECT_NE(input_error_of([&] { read_imu_file(folder.path()); }), "");
  EXPECT_NE(input_error_of([&] { read_imu_file(folder / "none.csv"); }), "");
}

}  // namespace
}  // namespace waymark
