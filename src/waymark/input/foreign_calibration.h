// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/camera/camchain.h"

namespace waymark {

/// The calibration of one camera as other programs write it, as a camchain. What is missing,
/// malformed or has no counterpart is an InputError with its line; so is what no camera model
/// accepts. What was passed over is in the notes.
///
/// OpenCV: a file of cv::FileStorage in YAML or XML, with the keys of its calibration sample:
/// image_width, image_height, camera_matrix, distortion_coefficients of 0, 4, 5, 8, or 12 or 14 the
/// last of which are 0; fisheye_model 1 for the cv::fisheye model. Spellings such as K and D are
/// accepted. With K1 D1 K2 D2 R T (or M1, M2) it is that of a pair. Without the "%YAML:1.0" with
/// which OpenCV's FileStorage begins and which is not YAML's directive.
ConfigSource without_opencv_header(ConfigSource source);

CameraChain read_opencv_calibration(const ConfigSource& source);
/// Whether it has the camera matrix, or those of a pair.
bool is_opencv_calibration(const ConfigNode& root);

/// ROS: a sensor_msgs/CameraInfo as camera_calibration saves it or `ros2 topic echo` prints it.
/// distortion_model plumb_bob, rational_polynomial, equidistant or fisheye. Of several messages,
/// each ended by ---, all are to be of one camera.
CameraChain read_ros_calibration(const ConfigSource& source);
/// Whether it is one; false also for what is no YAML.
bool is_ros_calibration(const ConfigSource& source);
/// The two files of a stereo calibration of ROS: where camera 1 is follows from R and P.
CameraChain read_ros_pair(const ConfigSource& camera0, const ConfigSource& camera1);

/// Sets the distortion as a sensor_msgs/CameraInfo states it: its distortion_model and D. Throws
/// InputError at `where` for a model that has no counterpart.
void set_ros_distortion(CameraDescription& camera,
                        std::string_view model,
                        std::vector<double> coeffs,
                        const std::string& where);

/// COLMAP: cameras.txt of a text model, or cameras.bin of a binary one; its first camera. COLMAP
/// counts pixels from the corner of the image; the result counts from the centre of the first
/// pixel.
CameraChain read_colmap_calibration(const ConfigSource& source);

/// nerfstudio and instant-ngp: transforms.json; the camera that all frames share, or that of the
/// first. Pixels count as in COLMAP.
CameraChain read_nerfstudio_calibration(const ConfigSource& source);

/// Files in which each number has a name: calibrations of Basalt, VINS / camodocal,
/// OpenImuCameraCalibrator, OpenSfM / ODM, and Metashape as XML. Nothing for any other.
std::optional<CameraChain> read_named_calibration(const ConfigNode& root, const std::string& file);

/// A file of one of these programs, or the sensor.yaml of an EuRoC data set, recognised by its
/// content; nothing for any other, such as a camchain.
std::optional<CameraChain> read_foreign_calibration(const ConfigSource& source);

}  // namespace waymark
