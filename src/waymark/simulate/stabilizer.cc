// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/stabilizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "waymark/base/check.h"
#include "waymark/image/opencv_image.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Standard deviation of the Gauss kernel that smooths the turning.
constexpr double kSmoothS = 0.5;
/// The largest turn of the cut, in rad, for each part of the width that it may shift.
constexpr double kTurnPerShare = 0.3;
/// What is cut off on all sides together, for the same.
constexpr double kCutPerShare = 2.5;
constexpr std::size_t kNumPlane = 4;

double zoom_of(double share) { return 1.0 / (1.0 - kCutPerShare * share); }

/// Near a limit the cut follows less and less.
double limited(double value, double limit) { return limit * std::tanh(value / limit); }

/// How far the camera has turned about its own axes since the first frame.
std::vector<Vector3d> turned(const std::function<Rigid3(int frame)>& world_from_cam,
                             int num_frames) {
  std::vector<Vector3d> sums = {Vector3d::Zero()};
  Rigid3 last = world_from_cam(0);
  for (int i = 1; i < num_frames; ++i) {
    const Rigid3 pose = world_from_cam(i);
    sums.push_back(sums.back() + so3_log(last.rotation.conjugate() * pose.rotation));
    last = pose;
  }
  return sums;
}

/// By how much each value differs from the mean of those around it.
std::vector<Vector3d> unsteadiness(const std::vector<Vector3d>& values, double sigma_frames) {
  const int count = static_cast<int>(values.size());
  const int reach = static_cast<int>(std::ceil(3.0 * sigma_frames));
  std::vector<Vector3d> differences;
  for (int i = 0; i < count; ++i) {
    Vector3d sum = Vector3d::Zero();
    double weights = 0.0;
    // No further on one side than on the other, or the ends would pull.
    const int near = std::min({reach, i, count - 1 - i});
    for (int k = i - near; k <= i + near; ++k) {
      const double weight = std::exp(-0.5 * std::pow((k - i) / sigma_frames, 2));
      sum += weight * values[static_cast<std::size_t>(k)];
      weights += weight;
    }
    differences.push_back(values[static_cast<std::size_t>(i)] - sum / weights);
  }
  return differences;
}

const double* plane_of(const CameraDescription& camera) {
  if (camera.intrinsics.size() < kNumPlane) {
    throw InputError("--stabilised",
                     fmt::format("camera model {} has neither focal length nor principal point: "
                                 "turning its images is harmless; expected another camera",
                                 camera.camera_model));
  }
  return camera.intrinsics.data() + camera.intrinsics.size() - kNumPlane;
}

Vector2d middle_of(const CameraDescription& camera) {
  return {0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)};
}

}  // namespace

Stabilizer::Stabilizer(const CameraDescription& picture,
                       const std::function<Rigid3(int frame)>& world_from_cam,
                       int num_frames,
                       double rate_hz,
                       double share)
    : middle_px_(middle_of(picture)), zoom_(zoom_of(share)) {
  const double* const plane = plane_of(picture);
  for (const Vector3d& off : unsteadiness(turned(world_from_cam, num_frames), kSmoothS * rate_hz)) {
    // A camera that looks too far to the right, or up, sees everything too far left, or down.
    cuts_.push_back({{limited(plane[0] * off.y(), share * picture.width_px),
                      limited(-plane[1] * off.x(), share * picture.height_px)},
                     limited(off.z(), kTurnPerShare * share)});
  }
}

Eigen::Matrix<double, 2, 3> Stabilizer::sensor_from_picture(int frame) const {
  const Cut& cut = cuts_.at(static_cast<std::size_t>(frame));
  const Eigen::Rotation2Dd back(-cut.turn_rad);
  Eigen::Matrix<double, 2, 3> result;
  result.leftCols<2>() = back.toRotationMatrix() / zoom_;
  result.col(2) = middle_px_ - result.leftCols<2>() * (cut.shift_px + middle_px_);
  return result;
}

Image Stabilizer::stabilize(const Image& sensor, int frame) const {
  const cv::Mat from = mat_of(sensor.view());
  cv::Mat to;
  const Eigen::Matrix<double, 2, 3, Eigen::RowMajor> map = sensor_from_picture(frame);
  const cv::Mat transform(2, 3, CV_64FC1, const_cast<double*>(map.data()));
  cv::warpAffine(from,
                 to,
                 transform,
                 from.size(),
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return image_of<std::uint8_t>(to);
}

CameraDescription sensor_of(CameraDescription picture, double share) {
  plane_of(picture);
  const Vector2d middle = middle_of(picture);
  double* const plane = picture.intrinsics.data() + picture.intrinsics.size() - kNumPlane;
  for (int axis = 0; axis < 2; ++axis) {
    plane[axis] /= zoom_of(share);
    plane[2 + axis] = middle[axis] + (plane[2 + axis] - middle[axis]) / zoom_of(share);
  }
  return picture;
}

}  // namespace waymark
