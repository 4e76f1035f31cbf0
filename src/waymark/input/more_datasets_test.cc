// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Data sets beside EuRoC, KITTI odometry and TUM RGB-D.
#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/input.h"
#include "waymark/input/testing/images.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;
using testing::write_image;

constexpr const char* kRawCalibration =
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.95e-02\n"
    "S_00: 40 30\nK_00: 41 0 17 0 42 13 0 0 1\nD_00: -0.3 0.2 0.001 0.002 -0.07\n"
    "R_00: 1 0 0 0 1 0 0 0 1\nT_00: 0 0 0\nS_rect_00: 32 24\n"
    "P_rect_00: 40 0 16 0 0 40 12 0 0 0 1 0\n"
    "S_01: 40 30\nK_01: 43 0 18 0 44 14 0 0 1\nD_01: -0.3 0.2 0.001 0.002 -0.07\n"
    "R_01: 1 0 0 0 1 0 0 0 1\nT_01: -0.5 0.01 0.02\nS_rect_01: 32 24\n"
    "P_rect_01: 40 0 16 -20 0 40 12 0 0 0 1 0\n";

/// A drive of three moments, of which the second has no image.
std::filesystem::path make_kitti_raw(const TemporaryFolder& folder, int width, int height) {
  folder.write("2011_09_26/calib_cam_to_cam.txt", kRawCalibration);
  const std::string drive = "2011_09_26/2011_09_26_drive_0001_sync";
  for (const char* camera : {"image_00", "image_01"}) {
    for (const char* name : {"0000000000.png", "0000000002.png"}) {
      write_image(folder / drive / camera / "data" / name, width, height, 50);
    }
    folder.write(drive + "/" + camera + "/timestamps.txt",
                 "2011-09-26 13:02:25.594360375\n2011-09-26 13:02:25.697814960\n"
                 "2011-09-26 13:02:25.801269000\n");
  }
  return folder / drive;
}

TEST(KittiRaw, TakesTimesAndTheCalibrationBesideTheDrive) {
  const TemporaryFolder folder;
  const auto input = open_input(make_kitti_raw(folder, 32, 24), {});
  EXPECT_EQ(input->info().format, "kitti");
  EXPECT_THAT(input->info().lines[0], HasSubstr("KITTI raw (stereo)"));
  const CameraChain& chain = *input->info().calibration;
  EXPECT_THAT(chain.cameras[0].description.intrinsics, ElementsAre(40, 40, 16, 12));
  EXPECT_EQ(chain.cameras[1].cam_from_rig.translation, Eigen::Vector3d(-0.5, 0, 0));
  EXPECT_EQ(input->next()->timestamp_ns, 1'317'042'145'594'360'375);
  EXPECT_EQ(input->next()->timestamp_ns, 1'317'042'145'801'269'000);
}

TEST(KittiRaw, TakesTheCalibrationBeforeRectificationForImagesOfThatSize) {
  const TemporaryFolder folder;
  const auto input = open_input(make_kitti_raw(folder, 40, 30), {});
  const CameraChain& chain = *input->info().calibration;
  EXPECT_THAT(chain.cameras[1].description.intrinsics, ElementsAre(43, 44, 18, 14));
  EXPECT_EQ(chain.cameras[1].description.distortion_model, "radtan");
  EXPECT_EQ(chain.cameras[1].cam_from_rig.translation, Eigen::Vector3d(-0.5, 0.01, 0.02));
}

TEST(KittiRaw, MayBeKitti360OrHaveColourAlone) {
  const TemporaryFolder folder;
  const std::filesystem::path drive = make_kitti_raw(folder, 32, 24);
  std::filesystem::rename(drive / "image_00/data", drive / "image_00/data_rect");
  std::filesystem::rename(drive / "image_01/data", drive / "image_01/data_rect");
  std::filesystem::rename(folder / "2011_09_26/calib_cam_to_cam.txt", folder / "gone");
  folder.write("calibration/perspective.txt", kRawCalibration);
  auto input = open_input(drive, {});
  EXPECT_THAT(input->info().lines[0], HasSubstr("KITTI-360 (stereo)"));
  EXPECT_EQ(input->info().calibration->cameras.size(), 2u);

  std::filesystem::rename(drive / "image_00", drive / "image_02");
  std::filesystem::remove_all(drive / "image_01");
  folder.write("calibration/perspective.txt", "P_rect_02: 50 0 16 0 0 50 12 0 0 0 1 0\n");
  input = open_input(drive, {});
  EXPECT_EQ(input->info().setup, Setup::kMono);
  EXPECT_EQ(input->info().calibration->cameras[0].description.intrinsics[0], 50);
}

TEST(KittiRaw, NamesFileAndLineOfWhatIsWrong) {
  const TemporaryFolder folder;
  const std::filesystem::path drive = make_kitti_raw(folder, 32, 24);
  const auto error = [&] { return input_error_of([&] { open_input(drive, {}); }); };
  const std::string times = "2011_09_26/2011_09_26_drive_0001_sync/image_00/timestamps.txt";
  folder.write(times, "2011-09-26 13:02:25.59\n2011-13-26 13:02:25.69\n");
  EXPECT_THAT(error(), HasSubstr("timestamps.txt:2: '2011-13-26 13:02:25.69' is no time"));
  folder.write(times, "2011-09-26 13:02:25.59\n");
  EXPECT_THAT(error(), HasSubstr("0000000002.png: is not named by one of the 1 rows of"));
  folder.write(times, "2011-09-26\n");
  EXPECT_THAT(error(), HasSubstr("timestamps.txt:1: 1 fields, expected 2"));
  make_kitti_raw(folder, 32, 24);
  folder.write("2011_09_26/calib_cam_to_cam.txt", "P_rect_00: 40 0 16\n");
  EXPECT_THAT(error(), HasSubstr("P_rect_00: 3 numbers, expected 12"));
  folder.write("2011_09_26/calib_cam_to_cam.txt", "P_rect_00: a\n");
  EXPECT_THAT(error(), HasSubstr("calib_cam_to_cam.txt:1"));
}

std::filesystem::path make_replica(const TemporaryFolder& folder) {
  folder.write("Replica/cam_params.json",
               R"({"camera": {"w": 32, "h": 24, "fx": 30.0, "fy": 30.0, "cx": 15.5, "cy": 11.5,
                   "scale": 6553.5}})");
  for (const char* number : {"000000", "000001"}) {
    const std::filesystem::path results = folder / "Replica/room0/results";
    write_image(results / (std::string("frame") + number + ".jpg"), 32, 24, 50);
    write_image(results / (std::string("depth") + number + ".png"), 32, 24, 6553, CV_16UC1);
  }
  return folder / "Replica/room0";
}

TEST(Replica, HasColourDepthAndCalibration) {
  const TemporaryFolder folder;
  const std::filesystem::path scene = make_replica(folder);
  const auto input = open_input(scene, {});
  EXPECT_EQ(input->info().format, "replica");
  EXPECT_EQ(input->info().setup, Setup::kRgbd);
  EXPECT_EQ(input->info().num_frames, std::size_t{2});
  EXPECT_EQ(input->info().calibration->depth_factor, 6553.5);
  EXPECT_EQ(input->info().calibration->cameras[0].description.intrinsics[2], 15.5);
  const InputFrame frame = input->next().value();
  EXPECT_EQ(frame.depth->view().at(3, 3), 6553);
  EXPECT_EQ(open_input(scene / "results", {})->info().format, "replica");

  const auto error = [&] { return input_error_of([&] { open_input(scene, {}); }); };
  folder.write("Replica/cam_params.json", R"({"camera": {"w": 32}})");
  EXPECT_THAT(error(), HasSubstr("cam_params.json: has no number camera.h, expected w, h, fx"));
  folder.write("Replica/cam_params.json", "{");
  EXPECT_THAT(error(), HasSubstr("cam_params.json: has no number"));
  std::filesystem::remove(scene / "results/depth000001.png");
  EXPECT_THAT(error(), HasSubstr("2 images frameN and 1 images depthN, expected as many"));
}

}  // namespace
}  // namespace waymark
