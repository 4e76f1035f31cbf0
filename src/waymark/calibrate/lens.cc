// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/lens.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/camera/registry.h"
#include "waymark/geometry/bearing.h"

namespace waymark {

std::string_view to_string(LensModel model) {
  switch (model) {
    case LensModel::kPerspective:
      return "perspective";
    case LensModel::kFisheye:
      return "fisheye";
    case LensModel::kEquirectangular:
      return "equirectangular";
  }
  return "unknown";
}

LensChange lens_sigmas(int width_px, double focal_sigma) {
  constexpr double kAspect = 0.003;
  const double center_px = 0.015 * width_px;
  LensChange sigmas;
  sigmas << focal_sigma, kAspect, center_px, center_px, 0.3, 0.2;
  return sigmas;
}

CameraDescription make_lens(LensModel model, double focal_px, int width_px, int height_px) {
  CameraDescription description;
  description.where = "calibration";
  description.width_px = width_px;
  description.height_px = height_px;
  description.camera_model = model == LensModel::kEquirectangular ? "equirectangular" : "pinhole";
  if (model == LensModel::kEquirectangular) return description;
  description.intrinsics = {focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1)};
  description.distortion_model = model == LensModel::kFisheye ? "equidistant" : "radtan";
  description.distortion_coeffs.assign(4, 0.0);
  return description;
}

double focal_length_of(LensModel model, double fov_rad, int width_px) {
  const double radius = model == LensModel::kFisheye ? 0.5 * fov_rad : std::tan(0.5 * fov_rad);
  return 0.5 * width_px / radius;
}

CameraDescription with_coefficients(LensModel model,
                                    double focal_px,
                                    double division,
                                    const CameraDescription& size) {
  constexpr int kNumRadii = 50;
  CameraDescription lens = make_lens(model, focal_px, size.width_px, size.height_px);
  std::copy_n(size.intrinsics.begin() + 2, 2, lens.intrinsics.begin() + 2);
  // radius = f * (x + k1 x^3 + k2 x^5), x the tangent of the angle, or the angle.
  Eigen::Matrix<double, kNumRadii, 3> powers;
  Eigen::Matrix<double, kNumRadii, 1> radii_px;
  for (int i = 0; i < kNumRadii; ++i) {
    radii_px[i] = 0.5 * std::hypot(size.width_px, size.height_px) * (i + 1) / kNumRadii;
    const double radius = radii_px[i] / focal_px;
    const double angle = std::atan2(radius, 1.0 + division * radius * radius);
    const double x = model == LensModel::kFisheye ? angle : std::tan(angle);
    powers.row(i) << x, x * x * x, x * x * x * x * x;
  }
  const Eigen::Vector3d fit = powers.colPivHouseholderQr().solve(radii_px);
  lens.intrinsics[0] = lens.intrinsics[1] = fit[0];
  lens.distortion_coeffs = {fit[1] / fit[0], fit[2] / fit[0], 0.0, 0.0};
  return lens;
}

double horizontal_fov_rad(const Camera& camera) {
  const double row = 0.5 * (camera.height_px() - 1);
  const std::vector<Eigen::Vector2d> borders = {{-0.5, row}, {camera.width_px() - 0.5, row}};
  std::vector<Eigen::Vector3d> bearings(2);
  std::vector<std::uint8_t> is_valid(2);
  camera.unproject(borders, bearings, is_valid);
  if (camera.wrap_width_px() > 0.0 || !is_valid[0] || !is_valid[1]) return 2.0 * std::numbers::pi;
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  return angle_between(bearings[0], axis) + angle_between(bearings[1], axis);
}

std::shared_ptr<const Camera> make_if_possible(const CameraDescription& description) {
  try {
    return CameraRegistry::with_builtin_models().make_camera(description);
  } catch (const InputError&) {
    return nullptr;
  }
}

std::optional<Lens> changed(const CameraDescription& description, const LensChange& change) {
  Lens lens{description, nullptr};
  if (!description.intrinsics.empty()) {
    std::vector<double>& intrinsics = lens.description.intrinsics;
    intrinsics[0] *= std::exp(change[0]);
    intrinsics[1] *= std::exp(change[0] + change[1]);
    for (int i = 0; i < 2; ++i) {
      intrinsics[static_cast<std::size_t>(2 + i)] += change[2 + i];
      lens.description.distortion_coeffs[static_cast<std::size_t>(i)] += change[4 + i];
    }
  }
  lens.camera = make_if_possible(lens.description);
  if (!lens.camera) return std::nullopt;
  return lens;
}

CameraDescription enlarged(CameraDescription description,
                           double factor,
                           int width_px,
                           int height_px) {
  description.width_px = width_px;
  description.height_px = height_px;
  for (std::size_t i = 0; i < description.intrinsics.size(); ++i) {
    double& value = description.intrinsics[i];
    value = i < 2 ? value * factor : (value + 0.5) * factor - 0.5;
  }
  return description;
}

}  // namespace waymark
