// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Data sets in the layouts of EuRoC, KITTI odometry and TUM RGB-D, good and bad.
#include <gmock/gmock.h>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/input/datasets.h"
#include "waymark/input/decode.h"
#include "waymark/input/input.h"
#include "waymark/input/testing/images.h"
#include "waymark/results/trajectory.h"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;
using testing::truncate_file;
using testing::write_image;

constexpr const char* kSensor =
    "T_BS:\n  cols: 4\n  rows: 4\n"
    "  data: [0, -1, 0, {X}, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    "resolution: [32, 24]\ncamera_model: pinhole\nintrinsics: [40, 41, 16, 12] #fu, fv, cu, cv\n"
    "distortion_model: radial-tangential\ndistortion_coefficients: [0.1, 0.2, 0.01, 0.02]\n";

std::string sensor_yaml(const std::string& x) {
  std::string text = kSensor;
  return text.replace(text.find("{X}"), 3, x);
}

constexpr const char* kTwoImages =
    "#timestamp [ns],filename\n1403636584763555584,a.png\n1403636584813555456,b.png\n";

/// Two pairs of images, 32x24, left 10 and 11, right 20 and 21.
void make_euroc(const TemporaryFolder& folder) {
  for (int camera = 0; camera < 2; ++camera) {
    const std::string base = "mav0/cam" + std::to_string(camera);
    folder.write(base + "/data.csv", kTwoImages);
    // The camera's x axis is the body's y axis: a step of 0.11 m along it.
    folder.write(base + "/sensor.yaml", sensor_yaml("0.5"));
    write_image(folder / (base + "/data/a.png"), 32, 24, 10 * (camera + 1));
    write_image(folder / (base + "/data/b.png"), 32, 24, 10 * (camera + 1) + 1);
  }
  std::string right = sensor_yaml("0.5");
  right.replace(right.find("1, 0, 0, 0, 0, 0, 1"), 10, "1, 0, 0, 0.11");
  folder.write("mav0/cam1/sensor.yaml", right);
}

TEST(Euroc, GivesImagesOfBothCamerasAsJpegWhereAsked) {
  const TemporaryFolder folder;
  make_euroc(folder);
  EXPECT_EQ(open_input(folder.path(), {.has_jpeg = true})->next()->right_jpeg, "");
  const InputOptions both = {.has_jpeg = true, .has_right_jpeg = true};
  const std::optional<InputFrame> first = open_input(folder.path(), both)->next();
  EXPECT_NEAR(decode_grey_image(first->right_jpeg)->view().at(5, 5), 20, 2);
  EXPECT_NE(first->right_jpeg, first->jpeg);
  const InputOptions one = {.setup = Setup::kMono, .has_jpeg = true, .has_right_jpeg = true};
  EXPECT_EQ(open_input(folder.path(), one)->next()->right_jpeg, "");
}

TEST(Euroc, GivesPairsWithExactTimesAndCalibration) {
  const TemporaryFolder folder;
  make_euroc(folder);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().format, "euroc");
  EXPECT_EQ(input->info().setup, Setup::kStereo);
  EXPECT_EQ(input->info().num_frames, std::size_t{2});
  EXPECT_EQ(input->info().width_px, 32);

  const std::optional<InputFrame> first = input->next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->timestamp_ns, 1403636584763555584);
  ASSERT_EQ(first->images.size(), 2u);
  EXPECT_EQ(first->images[0].view().at(31, 23), 10);
  EXPECT_EQ(first->images[1].view().at(0, 0), 20);
  EXPECT_EQ(input->next()->images[1].view().at(5, 5), 21);
  EXPECT_FALSE(input->next());

  const CameraChain& chain = *input->info().calibration;
  ASSERT_EQ(chain.cameras.size(), 2u);
  EXPECT_EQ(chain.cameras[0].description.distortion_model, "radtan");
  EXPECT_THAT(chain.cameras[0].description.intrinsics, ElementsAre(40, 41, 16, 12));
  // Camera 1 is 0.11 m to the right of camera 0, so points are 0.11 m further left in it.
  EXPECT_LT((chain.cameras[1].cam_from_rig.translation - Eigen::Vector3d(-0.11, 0, 0)).norm(),
            1e-12);
  EXPECT_LT(chain.cameras[0].cam_from_rig.log().norm(), 1e-12);
}

TEST(Euroc, MonoNeedsCameraZeroOnly) {
  const TemporaryFolder folder;
  make_euroc(folder);
  folder.write("mav0/cam1/data.csv", "garbage");
  InputOptions options;
  options.setup = Setup::kMono;
  const std::unique_ptr<Input> input = open_input(folder / "mav0", options);
  EXPECT_EQ(input->next()->images.size(), 1u);
  EXPECT_EQ(input->info().calibration->cameras.size(), 1u);
  options.setup = Setup::kRgbd;
  EXPECT_THAT(input_error_of([&] { open_input(folder.path(), options); }),
              HasSubstr("does not offer rgbd, expected --setup mono or stereo"));
}

TEST(Euroc, NamesFileAndLineOfWhatIsWrong) {
  const TemporaryFolder folder;
  make_euroc(folder);
  const auto error = [&] { return input_error_of([&] { open_input(folder.path(), {}); }); };
  folder.write("mav0/cam1/data.csv", "1403636599763555584,a.png\n1403636599913555456,b.png\n");
  EXPECT_THAT(error(), HasSubstr("cam1/data.csv: 0 of 2 frames have a partner in it"));
  folder.write("mav0/cam0/data.csv", "#t\n5,a.png\n5,b.png\n");
  EXPECT_THAT(error(), HasSubstr("cam0/data.csv: 1 of 2 images have a time that is not later"));
  folder.write("mav0/cam0/data.csv", "#t\n5.5,a.png\n");
  EXPECT_THAT(error(),
              HasSubstr("cam0/data.csv:2: field 1 is '5.5', expected a time in whole nanoseconds"));
  folder.write("mav0/cam0/data.csv", "5\n");
  EXPECT_THAT(error(), HasSubstr("cam0/data.csv:1: 1 fields, expected 2"));
  folder.write("mav0/cam0/data.csv", "# nothing\n");
  EXPECT_THAT(error(), HasSubstr("cam0/data.csv: empty, expected"));
  std::filesystem::remove(folder / "mav0/cam0/data.csv");
  EXPECT_THAT(error(), HasSubstr("cam0/data.csv: missing, expected"));
}

TEST(Euroc, RefusesBadCalibrationUnlessAnotherIsGiven) {
  const TemporaryFolder folder;
  make_euroc(folder);
  InputOptions options;
  const auto error = [&] { return input_error_of([&] { open_input(folder.path(), options); }); };
  folder.write("mav0/cam0/sensor.yaml",
               "resolution: [32, 24]\ncamera_model: pinhole\nintrinsics: [1, 1, 1, 1]\n");
  EXPECT_THAT(error(), HasSubstr("has no T_BS, expected"));
  folder.write("mav0/cam0/sensor.yaml", sensor_yaml("nan"));
  EXPECT_THAT(error(), HasSubstr("cam0/sensor.yaml"));
  folder.write("mav0/cam0/sensor.yaml", "[[[[");
  EXPECT_THAT(error(), HasSubstr("cam0/sensor.yaml"));
  CameraChain chain;
  chain.cameras.resize(1);
  chain.cameras[0].description.width_px = 32;
  chain.cameras[0].description.height_px = 24;
  options.calibration = chain;
  EXPECT_THAT(error(), HasSubstr("calibration of 1 camera(s), expected 2 for stereo"));
  options.setup = Setup::kMono;
  EXPECT_EQ(error(), "no error");
}

TEST(Euroc, SkipsBadImagesInTheMiddleButNotAFirstOneOfAnotherSize) {
  const TemporaryFolder folder;
  make_euroc(folder);
  truncate_file(folder / "mav0/cam1/data/b.png", 0.7);
  std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->next()->fault, FrameFault::kNone);
  std::optional<InputFrame> bad = input->next();
  EXPECT_EQ(bad->fault, FrameFault::kNone) << "camera 0 is used alone";
  EXPECT_EQ(bad->images.size(), 1u);
  EXPECT_THAT(bad->warning, HasSubstr("cam1/data/b.png (camera 1): unreadable"));
  EXPECT_EQ(bad->index, 1u);
  EXPECT_EQ(input->info().counts.without_partner, 1u);

  truncate_file(folder / "mav0/cam0/data/b.png", 0.7);
  input = open_input(folder.path(), {});
  input->next();
  bad = input->next();
  EXPECT_EQ(bad->fault, FrameFault::kUnreadable);
  EXPECT_TRUE(bad->images.empty());
  EXPECT_THAT(bad->warning, HasSubstr("cam0/data/b.png (camera 0): unreadable"));

  write_image(folder / "mav0/cam0/data/b.png", 32, 25, 0);
  input = open_input(folder.path(), {});
  input->next();
  EXPECT_EQ(input->next()->fault, FrameFault::kWrongSize);

  write_image(folder / "mav0/cam1/data/a.png", 33, 24, 0);
  EXPECT_THAT(
      input_error_of([&] { open_input(folder.path(), {}); }),
      HasSubstr("cam1/data/a.png: is 33x24 px, expected 32x24 px as the calibration of camera 1"));

  std::filesystem::remove_all(folder / "mav0/cam0/data");
  EXPECT_THAT(
      input_error_of([&] { open_input(folder.path(), {}); }),
      HasSubstr("cam0/data/a.png: missing, expected an image; none of 2 frames from it on"));
}

TEST(Euroc, TakesItsGroundTruthToCameraZero) {
  const TemporaryFolder folder;
  make_euroc(folder);
  const std::string csv = "mav0/state_groundtruth_estimate0/data.csv";
  folder.write(csv, "#timestamp,p,q,v\n7,1,2,3,1,0,0,0,9,9,9\n");
  EXPECT_EQ(find_groundtruth(folder.path()), std::filesystem::absolute(folder / csv));
  const std::vector<StampedPose> poses = read_trajectory(folder / csv);
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_LT((poses[0].world_from_camera.translation - Eigen::Vector3d(1.5, 2, 3)).norm(), 1e-12);
  EXPECT_LT(
      (poses[0].world_from_camera.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY())
          .norm(),
      1e-12);
}

constexpr const char* kCalibration =
    "P0: 40 0 16 0 0 40 12 0 0 0 1 0\nP1: 40 0 16 -20 0 40 12 0 0 0 1 0\n";

void make_kitti(const TemporaryFolder& folder) {
  folder.write("times.txt", "0.000000e+00\n1.037360e-01\n");
  folder.write("calib.txt", kCalibration);
  for (const char* name :
       {"image_0/000000.png", "image_0/000001.png", "image_1/000000.png", "image_1/000001.png"}) {
    write_image(folder / name, 32, 24, 50);
  }
}

TEST(Kitti, TakesBaselineFromTheProjectionsAndSizeFromTheImages) {
  const TemporaryFolder folder;
  make_kitti(folder);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().format, "kitti");
  const CameraChain& chain = *input->info().calibration;
  ASSERT_EQ(chain.cameras.size(), 2u);
  EXPECT_EQ(chain.cameras[1].cam_from_rig.translation, Eigen::Vector3d(-0.5, 0, 0));
  EXPECT_EQ(chain.cameras[1].description.width_px, 32);
  EXPECT_THAT(chain.cameras[0].description.intrinsics, ElementsAre(40, 40, 16, 12));
  input->next();
  EXPECT_EQ(input->next()->timestamp_ns, 103736000);
}

TEST(Kitti, NamesFileAndLineOfWhatIsWrong) {
  const TemporaryFolder folder;
  make_kitti(folder);
  const auto error = [&] { return input_error_of([&] { open_input(folder.path(), {}); }); };
  folder.write("calib.txt", "P0: 40 0 16 0 0 40 12 0 0 0 1 0\n");
  EXPECT_THAT(error(), HasSubstr("calib.txt: has no row P1:"));
  folder.write("calib.txt", "P0: 40 0 16\n");
  EXPECT_THAT(error(), HasSubstr("calib.txt:1: 4 fields, expected 13"));
  folder.write("calib.txt", "P0: 0 0 16 0 0 40 12 0 0 0 1 0\n");
  EXPECT_THAT(error(), HasSubstr("calib.txt:1: no projection of a rectified camera"));
  folder.write("calib.txt", kCalibration);
  folder.write("times.txt", "0\n0.1\n0.2\n");
  EXPECT_THAT(error(), HasSubstr("times.txt: 3 times, expected 2"));
  folder.write("times.txt", "");
  EXPECT_THAT(error(), HasSubstr("times.txt: empty, expected"));
  folder.write("times.txt", "0.1\n0.1\n");
  EXPECT_THAT(error(), HasSubstr("times.txt: 1 of 2 images have a time that is not later"));
  folder.write("times.txt", "0\n0.1\n");
  std::filesystem::rename(folder / "image_1/000001.png", folder / "image_1/7.png");
  std::filesystem::rename(folder / "image_1/000000.png", folder / "image_1/6.png");
  write_image(folder / "image_1/000002.png", 32, 24, 1);
  EXPECT_THAT(error(), HasSubstr("image_1: 3 images, none of the name of one of the 2 of"));
  std::filesystem::remove_all(folder / "image_1");
  EXPECT_EQ(error(), "no error");
}

TEST(Kitti, FindsPosesAndTheirTimes) {
  const TemporaryFolder folder;
  folder.write("dataset/poses/07.txt", "1 0 0 5 0 1 0 6 0 0 1 7\n");
  folder.write("dataset/sequences/07/times.txt", "12.5\n");
  const auto found = find_groundtruth(folder / "dataset/sequences/07");
  ASSERT_TRUE(found);
  const std::vector<StampedPose> poses = read_trajectory(*found);
  EXPECT_EQ(poses.at(0).timestamp_ns, 12'500'000'000);
  EXPECT_EQ(poses[0].world_from_camera.translation, Eigen::Vector3d(5, 6, 7));
  EXPECT_FALSE(find_groundtruth(folder.path()));
}

TEST(Kitti, DoesWithoutARightImageAndWithoutTimes) {
  const TemporaryFolder folder;
  make_kitti(folder);
  std::filesystem::remove(folder / "image_1/000001.png");
  std::filesystem::remove(folder / "times.txt");
  std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().counts.without_partner, 1u);
  EXPECT_EQ(input->next()->images.size(), 2u);
  const InputFrame alone = input->next().value();
  EXPECT_EQ(alone.images.size(), 1u);
  EXPECT_EQ(alone.fault, FrameFault::kNone);
  EXPECT_EQ(alone.timestamp_ns, 100'000'000) << "10 per second";
  input = open_input(folder.path(), {.fps = 4});
  input->next();
  EXPECT_EQ(input->next()->timestamp_ns, 250'000'000);
}

TEST(Euroc, LeavesOutTimesThatAreDoubleOrOutOfOrder) {
  const TemporaryFolder folder;
  make_euroc(folder);
  std::string left = "#timestamp [ns],filename\n";
  for (int i = 0; i < 20; ++i) left += std::to_string(1'000'000'000 + i * 50'000'000) + ",a.png\n";
  const std::string right = left;
  left += "1950000000,b.png\n1000000007,b.png\n";
  folder.write("mav0/cam0/data.csv", left);
  folder.write("mav0/cam1/data.csv", right);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().num_frames, std::size_t{20});
  EXPECT_EQ(input->info().counts.out_of_order, 2u);
  EXPECT_THAT(input->info().lines, Contains(HasSubstr("cam0/data.csv left out")));
}

TEST(PairDepth, PairsMutuallyNearestWithinTheLimit) {
  const std::vector<std::int64_t> colour = {0, 30, 60, 100};
  const std::vector<std::int64_t> depth = {2, 45, 46, 81};
  EXPECT_THAT(pair_depth(colour, depth, 20), ElementsAre(0u, 1u, 2u, 3u));
  EXPECT_THAT(pair_depth(colour, depth, 14), ElementsAre(0u, std::nullopt, 2u, std::nullopt));
  // One depth image between two colour images serves the nearer one.
  EXPECT_THAT(pair_depth({0, 10}, {6}, 20), ElementsAre(std::nullopt, 0u));
  EXPECT_THAT(pair_depth({0, 10}, {}, 20), ElementsAre(std::nullopt, std::nullopt));
}

void make_tum(const TemporaryFolder& folder) {
  folder.write("rgb.txt", "# colour\n10.00 rgb/a.png\n10.05 rgb/b.png\n10.10 rgb/c.png\n");
  folder.write("depth.txt", "# depth\n10.01 depth/a.png\n10.12 depth/c.png\n");
  for (const char* name : {"rgb/a.png", "rgb/b.png", "rgb/c.png"})
    write_image(folder / name, 32, 24, 90, CV_8UC3);
  for (const char* name : {"depth/a.png", "depth/c.png"})
    write_image(folder / name, 32, 24, 5000, CV_16UC1);
}

TEST(TumRgbd, KeepsColourImagesWithoutDepth) {
  const TemporaryFolder folder;
  make_tum(folder);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  EXPECT_EQ(input->info().setup, Setup::kRgbd);
  EXPECT_FALSE(input->info().calibration);
  const std::optional<InputFrame> first = input->next();
  EXPECT_EQ(first->timestamp_ns, 10'000'000'000);
  EXPECT_EQ(first->images.at(0).view().at(3, 3), 90);
  ASSERT_TRUE(first->depth);
  EXPECT_EQ(first->depth_lag_ns, 10'000'000);
  EXPECT_EQ(first->depth->view().at(31, 23), 5000);
  EXPECT_FALSE(input->next()->depth);
  EXPECT_TRUE(input->next()->depth);
  EXPECT_FALSE(input->next());
}

TEST(TumRgbd, DepthHasTheUnitsOfTheBenchmarkUnlessOthersAreStated) {
  const TemporaryFolder folder;
  make_tum(folder);
  InputOptions options;
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.width_px = 32;
  camera.height_px = 24;
  options.calibration.emplace().cameras.push_back({camera, Rigid3()});
  const InputInfo silent = open_input(folder.path(), options)->info();
  EXPECT_EQ(silent.calibration->depth_factor, 5000.0);
  EXPECT_THAT(silent.lines, ::testing::Contains(HasSubstr("depth in units of 1/5000 m")));
  options.calibration->depth_factor = 1000.0;
  const InputInfo stated = open_input(folder.path(), options)->info();
  EXPECT_EQ(stated.calibration->depth_factor, 1000.0);
  EXPECT_THAT(stated.lines, ::testing::Not(::testing::Contains(HasSubstr("in units of"))));
  options.calibration->depth_factor.reset();
  options.setup = Setup::kMono;
  EXPECT_FALSE(open_input(folder.path(), options)->info().calibration->depth_factor);
}

TEST(TumRgbd, ABadDepthImageInTheMiddleIsAMissingOne) {
  const TemporaryFolder folder;
  make_tum(folder);
  truncate_file(folder / "depth/c.png", 0.5);
  const std::unique_ptr<Input> input = open_input(folder.path(), {});
  input->next();
  input->next();
  const std::optional<InputFrame> last = input->next();
  EXPECT_EQ(last->fault, FrameFault::kNone);
  EXPECT_FALSE(last->depth);
  EXPECT_THAT(last->warning, HasSubstr("depth/c.png: unreadable, damaged or of another kind"));
  write_image(folder / "depth/c.png", 16, 12, 50, CV_16UC1);
  const std::unique_ptr<Input> again = open_input(folder.path(), {});
  again->next();
  EXPECT_EQ(again->next()->warning, "");  // The data set has no depth there.
  EXPECT_THAT(again->next()->warning, HasSubstr("c.png: is 16x12 px, expected 32x24 px"));
}

TEST(TumRgbd, NamesFileAndLineOfWhatIsWrong) {
  const TemporaryFolder folder;
  make_tum(folder);
  const auto error = [&] { return input_error_of([&] { open_input(folder.path(), {}); }); };
  write_image(folder / "depth/a.png", 32, 24, 50, CV_8UC1);
  EXPECT_THAT(error(),
              HasSubstr("depth/a.png: unreadable, damaged or of another kind, expected a 16-bit"));
  write_image(folder / "depth/a.png", 16, 12, 50, CV_16UC1);
  EXPECT_THAT(error(), HasSubstr("depth/a.png: depth of 16x12, expected 32x24"));
  folder.write("depth.txt", "20 depth/a.png\n");
  EXPECT_THAT(error(), HasSubstr("depth.txt: no depth image within 0.02 s"));
  folder.write("depth.txt", "20 /etc/passwd\n");
  EXPECT_THAT(error(),
              HasSubstr("depth.txt:1: field 2 is '/etc/passwd', expected a file name below"));
  folder.write("rgb.txt", "10 rgb/a.png\n9 rgb/b.png\n");
  EXPECT_THAT(error(), HasSubstr("rgb.txt: 1 of 2 images have a time that is not later"));
  folder.write("rgb.txt", "10\n");
  EXPECT_THAT(error(), HasSubstr("rgb.txt:1: 1 fields, expected 2"));
}

}  // namespace
}  // namespace waymark
