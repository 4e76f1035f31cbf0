// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "waymark/base/text.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/testing/gpmf_writer.h"

namespace waymark {
namespace {

using testing::big;
using ::testing::ElementsAre;
using testing::gpmf_element;
using testing::gpmf_payload;
using testing::gpmf_shorts;
using ::testing::SizeIs;

const GpmfStream* find(const std::vector<GpmfStream>& streams, const std::string& key) {
  const auto found = std::ranges::find(streams, key, &GpmfStream::key);
  return found == streams.end() ? nullptr : &*found;
}

TEST(Gpmf, ReadsScaledSamples) {
  const std::string payload = gpmf_payload(
      {gpmf_element("STMP", 'J', 8, big(1'000'005, 8)) + gpmf_element("TSMP", 'L', 4, big(7, 4)) +
           gpmf_element("STNM", 'c', 1, "Gyroscope") + gpmf_element("ORIN", 'c', 1, "XzY") +
           gpmf_element("SIUN", 'c', 5, "rad/s") + gpmf_shorts("SCAL", 1, {10}) +
           gpmf_shorts("GYRO", 3, {10, -20, 30, 40, 50, -60}),
       gpmf_shorts("SCAL", 1, {10, 100}) + gpmf_element("GRAV", 'l', 8, big(5, 4) + big(-50, 4)),
       gpmf_element("FACE", '?', 3, "abcdef"),
       gpmf_element("IORI", 'f', 4, big(0x3F800000, 4))});
  const std::vector<GpmfStream> streams = parse_gpmf(payload);
  ASSERT_THAT(streams, SizeIs(3));
  const GpmfStream& gyro = streams[0];
  EXPECT_EQ(gyro.key, "GYRO");
  EXPECT_EQ(gyro.device, "Made Up");
  EXPECT_EQ(gyro.axes, "XzY");
  EXPECT_EQ(gyro.num_total, 7U);
  EXPECT_EQ(gyro.num_samples(), 2U);
  EXPECT_THAT(gyro.values, ElementsAre(1, -2, 3, 4, 5, -6));
  EXPECT_THAT(streams[1].values, ElementsAre(0.5, -0.5));
  EXPECT_THAT(streams[2].values, ElementsAre(1.0));
}

TEST(Gpmf, TakesWhatIsWholeOfDamagedPayloads) {
  const std::string payload = testing::gpmf_imu_payload(20, 0);
  for (std::size_t size = 0; size < payload.size(); ++size) {
    EXPECT_LT(parse_gpmf(payload.substr(0, size)).size(), 2U) << size;
  }
  std::string deep = gpmf_shorts("GYRO", 3, {1, 2, 3});
  for (int i = 0; i < 1000; ++i) deep = gpmf_element("DEVC", '\0', 4, deep).substr(0, 60000);
  parse_gpmf(deep);
  for (std::size_t i = 0; i < payload.size(); ++i) {
    std::string bad = payload;
    bad[i] = static_cast<char>(bad[i] ^ 0xFF);
    parse_gpmf(bad);
  }
}

TEST(Gpmf, ReadsPayloadsOfCameras) {
  const char* cases = std::getenv("WAYMARK_CASES");
  if (!cases) GTEST_SKIP() << "WAYMARK_CASES is not set";
  const std::filesystem::path folder = std::filesystem::path(cases) / "gpmf_payloads";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "it has no gpmf_payloads";
  struct Camera {
    const char* name;
    std::size_t num_gyro, num_accl;
  };
  for (const Camera& camera : {Camera{"hero5.raw", 399, 199},
                               Camera{"hero6.raw", 204, 204},
                               Camera{"karma.raw", 392, 196},
                               Camera{"Fusion.raw", 3300, 197}}) {
    const auto streams = parse_gpmf(read_text_file(folder / camera.name, "a payload"));
    const GpmfStream* gyro = find(streams, "GYRO");
    const GpmfStream* accl = find(streams, "ACCL");
    ASSERT_TRUE(gyro && accl) << camera.name;
    EXPECT_EQ(gyro->num_samples(), camera.num_gyro) << camera.name;
    EXPECT_EQ(accl->num_samples(), camera.num_accl) << camera.name;
  }
  const auto hero5 = parse_gpmf(read_text_file(folder / "hero5.raw", "a payload"));
  EXPECT_NEAR(find(hero5, "ACCL")->values[0], 9.78, 0.01);
}

}  // namespace
}  // namespace waymark
