// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/square_pose.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace waymark {
namespace {

/// Corners further from the middle than this cannot be of a plane seen from its front.
constexpr double kLeastCosine = 0.05;

/// The frame of a camera that looks at the middle of the square, with its upper side level: any
/// part of any image is then as of a perspective camera.
Eigen::Quaterniond turn_ahead(const MarkerObservation& observation) {
  const auto bearing = [&](std::size_t i) { return observation.bearings[i].cast<double>().eval(); };
  const Eigen::Vector3d ahead = (bearing(0) + bearing(1) + bearing(2) + bearing(3)).normalized();
  const Eigen::Vector3d right = bearing(1) + bearing(2) - bearing(0) - bearing(3);
  const Eigen::Vector3d down = ahead.cross(right).normalized();
  Eigen::Matrix3d axes;
  axes << down.cross(ahead).transpose(), down.transpose(), ahead.transpose();
  return Eigen::Quaterniond(axes).normalized();
}

/// The frame of a marker with y down and z into the print. Seen from before it, it is nearly that
/// of the camera: OpenCV's rotation vectors of half a turn, which the other one would have, are
/// wrong.
const Eigen::Quaterniond kMarkerFromBack(0.0, 1.0, 0.0, 0.0);

Rigid3 rigid_of(const cv::Mat& rotation_vector, const cv::Mat& translation) {
  const Eigen::Vector3d turn(
      rotation_vector.at<double>(0), rotation_vector.at<double>(1), rotation_vector.at<double>(2));
  const Eigen::Vector3d shift(
      translation.at<double>(0), translation.at<double>(1), translation.at<double>(2));
  return {so3_exp(turn), shift};
}

}  // namespace

double squared_error_px(const MarkerObservation& observation,
                        const Rigid3& cam_from_marker,
                        double side) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d seen = (cam_from_marker * marker_corner(i, side)).normalized();
    const Eigen::Vector3d off = seen - observation.bearings[i].cast<double>();
    // The tangent plane does not tell what lies behind.
    if (seen.dot(observation.bearings[i].cast<double>()) <= 0.0) return 1e6;
    sum += (observation.pixel_from_bearing[i].cast<double>() * off).squaredNorm();
  }
  return sum / 4.0;
}

double mean_side_px(const MarkerObservation& observation) {
  float sum = 0.0f;
  for (std::size_t i = 0; i < 4; ++i) {
    // By bearings: pixels jump at the seam of 360 degree images.
    const std::size_t next = (i + 1) % 4;
    sum +=
        (observation.pixel_from_bearing[i] * (observation.bearings[next] - observation.bearings[i]))
            .norm();
  }
  return sum / 4.0;
}

std::vector<Rigid3> square_poses(const MarkerObservation& observation, double side) {
  const Eigen::Quaterniond ahead_from_cam = turn_ahead(observation);
  if (!ahead_from_cam.coeffs().allFinite()) return {};
  std::vector<cv::Point3d> corners;
  std::vector<cv::Point2d> seen;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d corner = kMarkerFromBack.conjugate() * marker_corner(i, side);
    corners.emplace_back(corner.x(), corner.y(), 0.0);
    const Eigen::Vector3d ahead = ahead_from_cam * observation.bearings[i].cast<double>();
    if (!(ahead.z() > kLeastCosine)) return {};
    seen.emplace_back(ahead.x() / ahead.z(), ahead.y() / ahead.z());
  }
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  try {
    cv::solvePnPGeneric(corners,
                        seen,
                        cv::Matx33d::eye(),
                        cv::noArray(),
                        rotations,
                        translations,
                        false,
                        cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};  // Corners on a line.
  }
  std::vector<Rigid3> poses;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const Rigid3 ahead_from_back = rigid_of(rotations[i], translations[i]);
    const Eigen::Quaterniond cam_from_ahead = ahead_from_cam.conjugate();
    const Rigid3 pose(
        (cam_from_ahead * ahead_from_back.rotation * kMarkerFromBack.conjugate()).normalized(),
        cam_from_ahead * ahead_from_back.translation);
    if (!pose.translation.allFinite() || !pose.rotation.coeffs().allFinite()) continue;
    poses.push_back(pose);
  }
  std::ranges::stable_sort(
      poses, {}, [&](const Rigid3& pose) { return squared_error_px(observation, pose, side); });
  return poses;
}

}  // namespace waymark
