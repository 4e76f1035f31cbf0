// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/exif.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/decode.h"
#include "waymark/input/input.h"

namespace waymark {
namespace {

constexpr ImageSize kSize{4000, 3000};

struct Entry {
  unsigned tag;
  unsigned type;  ///< 3 short, 4 long, 5 rational.
  std::uint32_t value;
  std::uint32_t denominator = 1;
};

/// A JPEG file as far as its Exif segment.
class ExifFile {
 public:
  explicit ExifFile(bool is_big) : is_big_(is_big) {}

  std::string make(const std::vector<Entry>& entries) {
    std::string tiff = is_big_ ? "MM" : "II";
    tiff += whole(42, 2) + whole(8, 4);
    tiff += whole(1, 2) + whole(0x8769, 2) + whole(4, 2) + whole(1, 4) + whole(26, 4) + whole(0, 4);
    const auto count = static_cast<std::uint32_t>(entries.size());
    tiff += whole(count, 2);
    std::string behind;
    for (const Entry& entry : entries) {
      tiff += whole(entry.tag, 2) + whole(entry.type, 2) + whole(1, 4);
      if (entry.type == 3) tiff += whole(entry.value, 2) + whole(0, 2);
      if (entry.type == 4) tiff += whole(entry.value, 4);
      if (entry.type != 5) continue;
      tiff += whole(26 + 2 + 12 * count + 4 + static_cast<std::uint32_t>(behind.size()), 4);
      behind += whole(entry.value, 4) + whole(entry.denominator, 4);
    }
    tiff += whole(0, 4) + behind;
    const std::string content = std::string("Exif\0\0", 6) + tiff;
    const auto length = static_cast<std::uint32_t>(content.size() + 2);
    return "\xFF\xD8\xFF\xE1" + std::string{static_cast<char>(length >> 8)} +
           static_cast<char>(length & 0xFF) + content + "\xFF\xDA";
  }

 private:
  std::string whole(std::uint32_t value, int count) const {
    std::string bytes;
    for (int i = 0; i < count; ++i) {
      bytes += static_cast<char>(value >> (8 * (is_big_ ? count - 1 - i : i)) & 0xFF);
    }
    return bytes;
  }

  bool is_big_;
};

const std::vector<Entry> kPhone = {
    {0x920A, 5, 425, 100}, {0xA002, 4, 4000}, {0xA003, 4, 3000}, {0xA405, 3, 26}};

TEST(Exif, TellsTheFocalLengthByFilm) {
  for (const bool is_big : {false, true}) {
    const std::string file = ExifFile(is_big).make(kPhone);
    EXPECT_NEAR(focal_px_in_exif(file, kSize).value_or(0.0), 26.0 / 43.267 * 5000.0, 0.1);
    EXPECT_NEAR(focal_px_in_exif(file, {1000, 750}).value_or(0.0), 26.0 / 43.267 * 1250.0, 0.1);
  }
}

TEST(Exif, TellsTheFocalLengthBySensor) {
  // 5 mm at 1000 pixels per cm.
  std::vector<Entry> entries = {
      {0x920A, 5, 50, 10}, {0xA002, 3, 4000}, {0xA20E, 5, 8000, 1}, {0xA210, 3, 3}};
  EXPECT_NEAR(focal_px_in_exif(ExifFile(true).make(entries), kSize).value_or(0.0), 4000.0, 1e-6);
  EXPECT_NEAR(
      focal_px_in_exif(ExifFile(true).make(entries), {2000, 1500}).value_or(0.0), 2000.0, 1e-6);
  entries.pop_back();  // Then per inch.
  EXPECT_NEAR(
      focal_px_in_exif(ExifFile(false).make(entries), kSize).value_or(0.0), 4000.0 / 2.54, 1e-6);
}

TEST(Exif, IsReadWhereNothingElseTells) {
  const testing::TemporaryFolder folder;
  const std::string jpeg = encode_jpeg(ColorImage(80, 60));
  const std::string exif = ExifFile(false).make({{0xA405, 3, 26}});
  std::ofstream(folder / "a.jpg") << exif.substr(0, exif.size() - 2) << jpeg.substr(2);
  const auto input = open_input(folder.path(), {});
  EXPECT_NEAR(input->info().focal_px.value_or(0.0), 26.0 / 43.267 * 100.0, 0.01);
  EXPECT_TRUE(input->next()->warning.empty());
  InputOptions options;
  options.calibration.emplace();
  options.calibration->cameras.push_back(
      {{"pinhole", {70.0, 70.0, 40.0, 30.0}, "none", {}, 80, 60, "test"}, Rigid3()});
  EXPECT_FALSE(open_input(folder.path(), options)->info().focal_px);
}

TEST(Exif, TellsNothingThatIsNotLikely) {
  ExifFile file(false);
  EXPECT_FALSE(focal_px_in_exif("", kSize));
  EXPECT_FALSE(focal_px_in_exif("\xFF\xD8\xFF\xDB", kSize));
  EXPECT_FALSE(focal_px_in_exif(file.make({}), kSize));
  EXPECT_FALSE(focal_px_in_exif(file.make({{0xA405, 3, 0}}), kSize)) << "unknown";
  EXPECT_FALSE(focal_px_in_exif(file.make({{0xA405, 3, 5000}}), kSize));
  EXPECT_FALSE(focal_px_in_exif(file.make({{0x920A, 5, 5, 0}, {0xA002, 3, 4000}}), kSize));
  EXPECT_FALSE(focal_px_in_exif(file.make(kPhone), {4000, 2000})) << "cropped";
}

TEST(Exif, SurvivesDamage) {
  const std::string file = ExifFile(true).make(kPhone);
  for (std::size_t length = 0; length < file.size(); ++length) {
    const std::string part = file.substr(0, length);
    focal_px_in_exif(part, kSize);
  }
  Rng rng(5, 0);
  for (int round = 0; round < 3000; ++round) {
    std::string damaged = file;
    for (int i = 0; i < 3; ++i) {
      damaged[rng.below(static_cast<std::uint32_t>(file.size()))] =
          static_cast<char>(rng.below(256));
    }
    const double focal_px = focal_px_in_exif(damaged, kSize).value_or(4000.0);
    EXPECT_TRUE(focal_px >= 0.2 * 4000.0 && focal_px <= 20.0 * 4000.0);
  }
}

}  // namespace
}  // namespace waymark
