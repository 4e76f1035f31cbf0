// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/input/input.h"
#include "waymark/input/listing.h"

namespace waymark {

// What open_input() recognises, a reader each.

/// One row of camN/data.csv.
struct EurocImage {
  std::int64_t timestamp_ns = 0;
  std::string name;   ///< In camN/data.
  std::string where;  ///< File and line, for errors.
};

/// Rows "nanoseconds,name", at least one, in any order. Throws InputError; name is what it
/// calls the file.
std::vector<EurocImage> parse_euroc_images(std::string_view text, const std::string& name);

/// camN/sensor.yaml.
struct EurocSensor {
  CameraDescription description;
  Rigid3 body_from_sensor;  ///< T_BS.
};

/// Parses sensor.yaml of a camera. Throws InputError.
EurocSensor parse_euroc_sensor(const ConfigSource& source);

/// Data set in the layout of EuRoC (Burri et al. 2016) and TUM-VI: mav0/cam0 and, for stereo,
/// mav0/cam1. folder is mav0 or the one that holds it. Calibration: sensor.yaml of each camera, or
/// dso/camchain.yaml beside mav0.
Listing list_euroc(const std::filesystem::path& folder, const InputOptions& options);

/// Whether the folder is or holds a mav0 with a camera.
bool is_euroc(const std::filesystem::path& folder);

/// What turns a pose of the sensor of mav0/SENSOR/data.csv (ground truth is of the body) into one
/// of camera 0, from the sensor.yaml files of both; identity without that of camera 0.
Rigid3 euroc_sensor_from_camera0(const std::filesystem::path& csv_path);

/// Parses calib.txt: rows "P0: 12 numbers", the 3x4 projection matrices of rectified cameras in the
/// frame of camera 0. Cameras come without a resolution. Throws InputError when one of the first
/// num_cameras is missing or malformed; name is what it calls the file.
CameraChain parse_kitti_calibration(std::string_view text,
                                    const std::string& name,
                                    std::size_t num_cameras);

/// Data set in the layout of KITTI odometry (Geiger et al. 2012): image_0/, for stereo image_1/,
/// times.txt. Calibration: calib.txt.
Listing list_kitti(const std::filesystem::path& folder, const InputOptions& options);

/// Whether the folder holds image_0/ with times.txt or calib.txt beside it.
bool is_kitti(const std::filesystem::path& folder);

/// Drive of KITTI raw (Geiger et al. 2013) or KITTI-360 (Liao et al. 2022): image_00/data/ or
/// image_00/data_rect/, for stereo image_01, times in image_00/timestamps.txt; where there are no
/// grey images those of the colour cameras, image_02 and image_03. Calibration:
/// calib_cam_to_cam.txt beside the drive, or calibration/perspective.txt of KITTI-360; that before
/// rectification for images of that size.
Listing list_kitti_raw(const std::filesystem::path& folder, const InputOptions& options);

/// Whether the folder holds image_00 (or image_02) with data/ and timestamps.txt.
bool is_kitti_raw(const std::filesystem::path& folder);

/// Scene of Replica as rendered for SLAM (Straub et al. 2019, Sucar et al. 2021): results/ with
/// frame000000.jpg and depth000000.png and so on. Calibration: cam_params.json beside the scenes.
Listing list_replica(const std::filesystem::path& folder, const InputOptions& options);

/// Whether the folder, or results/ in it, holds images frameN and depthN.
bool is_replica(const std::filesystem::path& folder);

/// One row of rgb.txt or depth.txt.
struct TumImage {
  std::int64_t timestamp_ns = 0;
  std::string name;  ///< Below the folder of the data set.
};

/// Rows "seconds name", at least one, in any order. Throws InputError; name is what it calls
/// the file.
std::vector<TumImage> parse_tum_images(std::string_view text, const std::string& name);

/// For each colour time the index of its depth image: the two are nearest to each other and at most
/// max_difference_ns apart. Both lists increase. A depth image serves one colour image.
std::vector<std::optional<std::size_t>> pair_depth(const std::vector<std::int64_t>& colour_ns,
                                                   const std::vector<std::int64_t>& depth_ns,
                                                   std::int64_t max_difference_ns);

/// Data set in the layout of TUM RGB-D (Sturm et al. 2012): rgb.txt and, for depth, depth.txt.
Listing list_tum_rgbd(const std::filesystem::path& folder, const InputOptions& options);

/// Folder of images, or one that holds them in images/; with options.right a second one for stereo,
/// with options.depth one of depth images. Times come from times.txt in the folder or beside it;
/// without one from options.fps, else from the names of the images, else they are 1/30 s apart.
Listing list_image_folder(const std::filesystem::path& folder, const InputOptions& options);

/// The images of options.image_list, with options.right or options.depth as above.
Listing list_named_images(const InputOptions& options, const std::filesystem::path& name);

/// The file of true poses that belongs to an input, if its layout has one and it is there:
/// mav0/state_groundtruth_estimate0/data.csv (EuRoC), mav0/mocap0/data.csv (TUM-VI),
/// groundtruth.txt (TUM), poses.txt or ../../poses/NN.txt of sequences/NN (KITTI). For an input
/// that is a file they are looked for beside it. read_trajectory() reads what is found.
std::optional<std::filesystem::path> find_groundtruth(const std::filesystem::path& input);

/// The videos of a folder in the order of their names, if together they are one recording, as they
/// are where there is one only: cameras begin a new file after so many minutes or bytes. Those say
/// so by name (GoPro's GH010123.MP4 GH020123.MP4, GOPR0123.MP4 GP010123.MP4), or were begun when
/// the one before ended, as they state it. Nothing for others.
std::vector<std::filesystem::path> find_chapters(const std::filesystem::path& folder);

/// Opens a video, of one or several files. Times come from times.txt beside it (one per frame),
/// else from the container. Reads the first frame. Throws InputError.
std::unique_ptr<Input> open_video(const std::vector<std::filesystem::path>& files,
                                  const InputOptions& options);

/// Opens a bag of ROS: a .bag, .mcap or .db3 file, or the folder of a bag of ROS 2. Reads the first
/// frame. Throws InputError.
std::unique_ptr<Input> open_bag(const std::filesystem::path& path, const InputOptions& options);

/// Opens a camera, "camera:N", a device such as /dev/video0 or the address of a stream, and reads
/// its first frame. Asks for images of the size that the calibration states. Throws InputError.
std::unique_ptr<Input> open_camera(const std::filesystem::path& path, const InputOptions& options);

}  // namespace waymark
