// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_calibration.h"

#include <algorithm>
#include <utility>

#include "waymark/input/foreign_calibration.h"

namespace waymark {
namespace {

constexpr double kLeastBaselineM = 1e-6;

/// The origin of the rectified frame of a pair in that of one of its cameras.
Eigen::Vector3d rectified_offset(const RosCameraInfo& info) {
  if (info.p[0] == 0.0 || info.p[5] == 0.0) return Eigen::Vector3d::Zero();
  return {info.p[3] / info.p[0], info.p[7] / info.p[5], 0.0};
}

Rigid3 rectified_from_camera(const RosCameraInfo& info,
                             bool is_rectified,
                             const std::string& where) {
  const bool has_rotation = std::ranges::any_of(info.r, [](double value) { return value != 0.0; });
  if (is_rectified || !has_rotation) return {};
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.r.data());
  return rigid_from_matrix(matrix, where, "R");
}

/// The focal lengths and centre of the images, of which the calibration is that of all pixels.
std::vector<double> intrinsics_of_images(const RosCameraInfo& info, bool is_rectified) {
  const double fu = is_rectified ? info.p[0] : info.k[0];
  const double fv = is_rectified ? info.p[5] : info.k[4];
  const double pu = is_rectified ? info.p[2] : info.k[2];
  const double pv = is_rectified ? info.p[6] : info.k[5];
  const double binning_x = std::max(info.binning_x, 1U);
  const double binning_y = std::max(info.binning_y, 1U);
  return {fu / binning_x,
          fv / binning_y,
          (pu - info.roi_x_px) / binning_x,
          (pv - info.roi_y_px) / binning_y};
}

/// The camera info that belongs to images: beside them, or of the same coordinate frame.
std::optional<RosCameraInfo> find_info(Bag& bag, const ImageTopic& image) {
  std::optional<RosCameraInfo> of_frame;
  std::vector<bool> is_seen(bag.content().topics.size());
  for (const BagMessage& message : bag.content().messages) {
    const BagTopic& topic = bag.content().topics[message.topic];
    if (is_seen[message.topic] || topic.type != "sensor_msgs/CameraInfo") continue;
    is_seen[message.topic] = true;
    std::optional<RosCameraInfo> info = parse_ros_camera_info(bag.read(message), topic.encoding);
    if (!info) continue;
    if (std::ranges::count(image.info_names(), topic.name) > 0) return info;
    if (!image.frame_id.empty() && info->frame_id == image.frame_id) of_frame = std::move(info);
  }
  return of_frame;
}

}  // namespace

std::optional<ChainCamera> camera_of_info(const RosCameraInfo& info,
                                          bool is_rectified,
                                          const std::string& where) {
  const bool is_of_p = is_rectified && info.p[0] != 0.0;
  ChainCamera camera;
  CameraDescription& description = camera.description;
  description.where = where;
  description.camera_model = "pinhole";
  description.intrinsics = intrinsics_of_images(info, is_of_p);
  if (description.intrinsics[0] == 0.0 || description.intrinsics[1] == 0.0) return std::nullopt;
  constexpr std::uint32_t kLargest = 1'000'000;
  const std::uint32_t width = info.roi_width_px > 0 ? info.roi_width_px : info.width_px;
  const std::uint32_t height = info.roi_height_px > 0 ? info.roi_height_px : info.height_px;
  description.width_px = static_cast<int>(std::min(width, kLargest) / std::max(info.binning_x, 1U));
  description.height_px =
      static_cast<int>(std::min(height, kLargest) / std::max(info.binning_y, 1U));
  // Drivers of cameras without distortion name any model, but fisheyes bend without any, too.
  const bool is_fisheye =
      info.distortion_model == "equidistant" || info.distortion_model == "fisheye";
  const bool is_distorted = std::ranges::any_of(info.d, [](double value) { return value != 0.0; });
  if (!is_rectified && (is_distorted || is_fisheye)) {
    set_ros_distortion(description, info.distortion_model, info.d, where);
  }
  return camera;
}

std::optional<Rigid3> right_from_left(const RosCameraInfo& left,
                                      const RosCameraInfo& right,
                                      bool is_rectified,
                                      const std::string& where) {
  const Eigen::Vector3d baseline = rectified_offset(right) - rectified_offset(left);
  if (baseline.norm() < kLeastBaselineM) return std::nullopt;
  return rectified_from_camera(right, is_rectified, where).inverse() *
         Rigid3(Eigen::Quaterniond::Identity(), baseline) *
         rectified_from_camera(left, is_rectified, where);
}

std::optional<CameraChain> calibration_of(Bag& bag, const TopicChoice& choice) {
  const bool is_rectified = choice.first.is_rectified();
  const std::optional<RosCameraInfo> left = find_info(bag, choice.first);
  if (!left) return std::nullopt;
  std::optional<ChainCamera> camera = camera_of_info(*left, is_rectified, choice.first.name);
  if (!camera) return std::nullopt;
  CameraChain chain;
  chain.cameras.push_back(*std::move(camera));
  if (choice.setup != Setup::kStereo) return chain;
  const std::string& where = choice.second->name;
  const std::optional<RosCameraInfo> right = find_info(bag, *choice.second);
  if (!right) return std::nullopt;
  camera = camera_of_info(*right, choice.second->is_rectified(), where);
  const std::optional<Rigid3> cam_from_rig = right_from_left(*left, *right, is_rectified, where);
  if (!camera || !cam_from_rig) return std::nullopt;
  camera->cam_from_rig = *cam_from_rig;
  chain.cameras.push_back(*std::move(camera));
  return chain;
}

}  // namespace waymark
