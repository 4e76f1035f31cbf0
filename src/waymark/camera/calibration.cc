// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/camera/pixel_angles.h"

namespace waymark {
namespace {

/// Numbers of at least this size are lengths in pixels: focal lengths and principal points.
constexpr double kMinPixels = 10.0;
/// Calibrations are that good, of another day, lens setting or temperature, and of images that were
/// rectified by one (docs/decisions/calibrate.md).
constexpr double kPixelsSigma = 0.002;  // Relative to the length.
constexpr double kAspectSigma = 0.002;  // Pixels are square.
constexpr double kShapeSigma = 0.005;   // xi, alpha, beta, ...
constexpr double kRadialSigma = 0.02;
constexpr double kTangentialSigma = 5e-4;
constexpr double kTurnSigma = 1e-3;         // rad
constexpr double kReadoutSigma = 20.0;      // ms
constexpr double kDepthOffsetSigma = 0.02;  // 1/m
/// A camera that turns and a sensor that shifts look nearly the same; cameras of a rig turn.
constexpr double kSensorSigma = 0.05;  // px
/// Of the terms of a BearingError at the side of the image: linear and quadratic.
constexpr double kLinearErrorSigma = 0.5;     // px
constexpr double kQuadraticErrorSigma = 1.0;  // px
/// However many images tell the same, disparities are off by so much, as where surfaces are
/// slanted, and focal lengths and distortions by this part of the usual standard deviation: so much
/// do recordings of one camera differ.
constexpr double kSystematicErrorPx = 0.15;
constexpr double kSystematicPart = 0.15;
/// Rectified images of cars on the road look like readouts of 7 ms from the bottom up.
constexpr double kSystematicReadout = 2.5;       // ms
constexpr double kSystematicDepthOffset = 2e-3;  // 1/m
/// All cameras of a rig read their rows in the same time.
constexpr double kSameReadout = 1e-3;  // ms
/// Models with more numbers are taken as they are.
constexpr std::size_t kMaxIntrinsics = 27;

/// What is held may change by this part of its usual standard deviation; what is surer than that is
/// exact.
constexpr double kHeld = 1e-4;

constexpr std::array<const char*, 4> kPlaneNames = {"fu", "fv", "pu", "pv"};
constexpr std::array<const char*, 5> kTurnNames = {
    "turn_x", "turn_y", "turn_z", "baseline_a", "baseline_b"};
constexpr std::size_t kNumTurns = 3;
constexpr int kNumErrors = 2 * BearingError::kNumTerms;
constexpr std::array<const char*, kNumErrors> kErrorNames = {"along_x",
                                                             "along_y",
                                                             "along_xx",
                                                             "along_xy",
                                                             "along_yy",
                                                             "across_x",
                                                             "across_y",
                                                             "across_xx",
                                                             "across_xy",
                                                             "across_yy"};

std::string distortion_name(const CameraDescription& description, std::size_t i) {
  if (description.distortion_model != "radtan") return fmt::format("k{}", i + 1);
  constexpr std::array<const char*, 8> kNames = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  return i < kNames.size() ? kNames[i] : fmt::format("distortion{}", i);
}

/// What images may tell of a camera, in the numbers of its model.
CameraDescription described_fully(CameraDescription description) {
  if (description.camera_model == "pinhole" && description.distortion_model == "none") {
    description.distortion_model = "radtan";
    description.distortion_coeffs.assign(4, 0.0);
  }
  return description;
}

}  // namespace

CalibrationParameters::CalibrationParameters(const Rig& given) : given_(given) {
  for (std::size_t c = 0; c < given_.cameras.size(); ++c) {
    Block block{list_.size(), 0, 0, false};
    add_projection(c);
    block.num_projection = list_.size() - block.first;
    block.has_extrinsics = c > 0 && given_.cameras[c].cam_from_rig.translation.norm() > 0.0;
    if (block.has_extrinsics) add_bearing_error(c);
    if (given_.cameras.size() > 1 || block.num_projection > 0) add_sensor(c);
    block.num_intrinsics = list_.size() - block.first;
    if (block.has_extrinsics) add_extrinsics(c);
    blocks_.push_back(block);
  }
  tie_alike();
}

/// Pixels are square; cameras of a rig are of one kind.
void CalibrationParameters::tie_alike() {
  const auto count = static_cast<Eigen::Index>(list_.size());
  ties_.setZero(count, count);
  for (const std::size_t fu : find(".fu")) {
    const double ratio = list_[fu].given / list_[fu + 1].given;
    tie(fu, fu + 1, ratio, kAspectSigma * list_[fu].given);
  }
  for (const auto& [name, sigma] : {std::pair{".pu", kSensorSigma},
                                    std::pair{".pv", kSensorSigma},
                                    std::pair{"readout_ms", kSameReadout}}) {
    const std::vector<std::size_t> of_cameras = find(name);
    for (std::size_t i = 1; i < of_cameras.size(); ++i)
      tie(of_cameras[0], of_cameras[i], 1.0, sigma);
  }
}

Eigen::MatrixXd CalibrationParameters::prior_information(const std::vector<double>& sigmas) const {
  Eigen::MatrixXd information = ties_;
  for (std::size_t i = 0; i < list_.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double sigma = sigmas[i] > 0.0 ? sigmas[i] : kHeld * list_[i].usual_sigma;
    information(at, at) += 1.0 / (sigma * sigma);
  }
  return information;
}

std::vector<std::size_t> CalibrationParameters::find(std::string_view ending) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < list_.size(); ++i) {
    if (list_[i].name.ends_with(ending)) found.push_back(i);
  }
  return found;
}

std::optional<std::size_t> CalibrationParameters::find(CalibrationGroup group) const {
  const auto found = std::ranges::find(list_, group, &CalibrationParameter::group);
  if (found == list_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - list_.begin());
}

/// Change a is `ratio` times change b, up to a standard deviation.
void CalibrationParameters::tie(std::size_t a, std::size_t b, double ratio, double sigma) {
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(ties_.rows());
  difference[static_cast<Eigen::Index>(a)] = 1.0 / sigma;
  difference[static_cast<Eigen::Index>(b)] = -ratio / sigma;
  ties_ += difference * difference.transpose();
}

/// Appends a parameter, whose prior is what the calibration says or, without that, as usual.
/// sigmas: what it says of all numbers of this kind; i: which of them this is.
void CalibrationParameters::add(CalibrationParameter parameter,
                                const std::vector<double>& sigmas,
                                std::size_t i) {
  const double sigma = i < sigmas.size() ? sigmas[i] : parameter.usual_sigma;
  parameter.prior_sigma = sigma < kHeld * parameter.usual_sigma ? 0.0 : sigma;
  list_.push_back(std::move(parameter));
}

void CalibrationParameters::add_projection(std::size_t camera) {
  RigCamera& calibrated = given_.cameras[camera];
  if (!calibrated.description || !calibrated.remake) return;
  calibrated.description = described_fully(*calibrated.description);
  const CameraDescription& description = *calibrated.description;
  if (description.intrinsics.size() + description.distortion_coeffs.size() > kMaxIntrinsics) return;
  const std::vector<double>& intrinsics = description.intrinsics;
  const std::size_t num_shape = intrinsics.size() < 4 ? intrinsics.size() : intrinsics.size() - 4;
  const std::string prefix = fmt::format("cam{}.", camera);
  for (std::size_t i = 0; i < intrinsics.size(); ++i) {
    CalibrationParameter parameter;
    parameter.given = intrinsics[i];
    parameter.usual_sigma = kPixelsSigma * std::max(std::abs(intrinsics[i]), kMinPixels);
    if (i < num_shape) {
      parameter.name = prefix + fmt::format("shape{}", i + 1);
      parameter.group = CalibrationGroup::kRadial;
      if (std::abs(intrinsics[i]) < kMinPixels) parameter.usual_sigma = kShapeSigma;
    } else {
      parameter.name = prefix + kPlaneNames[i - num_shape];
      if (i - num_shape >= 2) parameter.group = CalibrationGroup::kCentre;
    }
    if (parameter.group != CalibrationGroup::kCentre) {
      parameter.systematic_sigma = kSystematicPart * parameter.usual_sigma;
    }
    add(std::move(parameter), calibrated.sigmas.intrinsics, i);
  }
  for (std::size_t i = 0; i < description.distortion_coeffs.size(); ++i) {
    const bool is_tangential = description.distortion_model == "radtan" && (i == 2 || i == 3);
    add({.name = prefix + distortion_name(description, i),
         .given = description.distortion_coeffs[i],
         .group = is_tangential ? CalibrationGroup::kTangential : CalibrationGroup::kRadial,
         .usual_sigma = is_tangential ? kTangentialSigma : kRadialSigma,
         .systematic_sigma = is_tangential ? 0.0 : kSystematicPart * kRadialSigma},
        calibrated.sigmas.distortion_coeffs,
        i);
  }
}

void CalibrationParameters::add_bearing_error(std::size_t camera) {
  const Camera& model = *given_.cameras[camera].camera;
  const double pixel_rad = central_pixel_angle(model);
  const double x = std::min(0.5 * model.width_px() * pixel_rad, 1.0);
  const double y = std::min(0.5 * model.height_px() * pixel_rad, 1.0);
  const std::array<double, BearingError::kNumTerms> at_side = {x, y, x * x, x * y, y * y};
  for (int i = 0; i < kNumErrors; ++i) {
    const int term = i % BearingError::kNumTerms;
    const bool is_linear = term < 2;
    const double to_bearing = pixel_rad / at_side[static_cast<std::size_t>(term)];
    add({.name = fmt::format("cam{}.{}", camera, kErrorNames[static_cast<std::size_t>(i)]),
         .group =
             i < BearingError::kNumTerms ? CalibrationGroup::kAlong : CalibrationGroup::kAcross,
         .usual_sigma = to_bearing * (is_linear ? kLinearErrorSigma : kQuadraticErrorSigma),
         .systematic_sigma = to_bearing * kSystematicErrorPx},
        {},
        0);
  }
}

/// How the sensor measures: the readout and, of a single camera, the depth image.
void CalibrationParameters::add_sensor(std::size_t camera) {
  add({.name = camera == 0 ? "readout_ms" : fmt::format("cam{}.readout_ms", camera),
       .given = 1e3 * given_.cameras[camera].readout_s,
       .group = CalibrationGroup::kReadout,
       .usual_sigma = kReadoutSigma,
       .systematic_sigma = kSystematicReadout},
      {},
      0);
  if (given_.cameras.size() > 1) return;
  add({.name = "depth.inverse_offset",
       .given = given_.inverse_depth_offset,
       .group = CalibrationGroup::kDepthOffset,
       .usual_sigma = kDepthOffsetSigma,
       .systematic_sigma = kSystematicDepthOffset},
      {},
      0);
}

void CalibrationParameters::add_extrinsics(std::size_t camera) {
  const CalibrationSigmas& sigmas = given_.cameras[camera].sigmas;
  const double pixel_rad = central_pixel_angle(*given_.cameras[camera].camera);
  for (std::size_t i = 0; i < kTurnNames.size(); ++i) {
    const bool is_turn = i < kNumTurns;
    add({.name = fmt::format("cam{}.{}", camera, kTurnNames[i]),
         .group = CalibrationGroup::kExtrinsics,
         .usual_sigma = kTurnSigma,
         .systematic_sigma = kSystematicErrorPx * pixel_rad},
        is_turn ? sigmas.rotation_rad : sigmas.baseline_direction_rad,
        is_turn ? i : i - kNumTurns);
  }
}

std::vector<CalibrationSigmas> CalibrationParameters::by_camera(
    const std::vector<double>& sigmas) const {
  WAYMARK_CHECK(sigmas.size() == size());
  std::vector<CalibrationSigmas> by_camera;
  for (std::size_t c = 0; c < blocks_.size(); ++c) {
    auto next = sigmas.begin() + static_cast<std::ptrdiff_t>(blocks_[c].first);
    const auto take = [&next](std::size_t count) {
      const auto first = std::exchange(next, next + static_cast<std::ptrdiff_t>(count));
      return std::vector<double>(first, next);
    };
    CalibrationSigmas& of_camera = by_camera.emplace_back();
    if (blocks_[c].num_projection > 0) {
      const CameraDescription& description = *given_.cameras[c].description;
      of_camera.intrinsics = take(description.intrinsics.size());
      of_camera.distortion_coeffs = take(description.distortion_coeffs.size());
    }
    if (!blocks_[c].has_extrinsics) continue;
    take(blocks_[c].num_intrinsics - blocks_[c].num_projection);
    of_camera.rotation_rad = take(kNumTurns);
    of_camera.baseline_direction_rad = take(kTurnNames.size() - kNumTurns);
  }
  return by_camera;
}

CameraDescription CalibrationParameters::description_at(std::size_t camera,
                                                        const Eigen::VectorXd& change) const {
  CameraDescription description = *given_.cameras[camera].description;
  auto at = static_cast<Eigen::Index>(blocks_[camera].first);
  for (double& value : description.intrinsics) value += change[at++];
  for (double& value : description.distortion_coeffs) value += change[at++];
  return description;
}

std::optional<Rig> CalibrationParameters::rig_at(const Eigen::VectorXd& change) const {
  WAYMARK_CHECK(change.size() == static_cast<Eigen::Index>(size()));
  Rig rig = given_;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    RigCamera& camera = rig.cameras[c];
    if (blocks_[c].num_projection > 0) {
      camera.description = description_at(c, change);
      try {
        camera.camera = camera.remake(*camera.description);
      } catch (const InputError&) {
        return std::nullopt;  // No such camera: the step was too long.
      }
    }
    const Block& block = blocks_[c];
    auto at = static_cast<Eigen::Index>(block.first + block.num_projection);
    if (block.has_extrinsics) {
      constexpr int kNumTerms = BearingError::kNumTerms;
      camera.bearing_error.along_rad += change.segment<kNumTerms>(at);
      camera.bearing_error.across_rad += change.segment<kNumTerms>(at + kNumTerms);
      at += kNumErrors;
      const auto turns = static_cast<Eigen::Index>(block.first + block.num_intrinsics);
      camera.cam_from_rig = turned(camera.cam_from_rig, change.segment<5>(turns));
    }
    if (block.num_intrinsics > 0) camera.readout_s += 1e-3 * change[at];
  }
  if (const auto at = find(CalibrationGroup::kDepthOffset)) {
    rig.inverse_depth_offset += change[static_cast<Eigen::Index>(*at)];
  }
  return rig;
}

std::optional<CameraChain> chain_of(const Rig& rig,
                                    std::span<const CalibrationEstimate> estimates) {
  const CalibrationParameters parameters(rig);
  std::vector<double> sigmas;
  for (const CalibrationParameter& parameter : parameters.list()) {
    const auto told = std::ranges::find(estimates, parameter.name, &CalibrationEstimate::name);
    sigmas.push_back(told == estimates.end() ? parameter.prior_sigma : told->sigma);
  }
  std::vector<CalibrationSigmas> told;
  if (!estimates.empty()) told = parameters.by_camera(sigmas);
  CameraChain chain;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const RigCamera& camera = rig.cameras[c];
    if (!camera.description) return std::nullopt;
    chain.cameras.push_back({*camera.description,
                             camera.cam_from_rig,
                             camera.readout_s,
                             told.empty() ? camera.sigmas : told[c]});
  }
  return chain;
}

Eigen::Matrix<double, 3, 2> across_baseline(const Eigen::Vector3d& baseline) {
  const Eigen::Vector3d along = baseline.normalized();
  const Eigen::Vector3d side =
      std::abs(along.y()) < 0.7 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = along.cross(side).normalized();
  across.col(1) = along.cross(across.col(0));
  return across;
}

Rigid3 turned(const Rigid3& cam_from_rig, const Eigen::Matrix<double, 5, 1>& turns) {
  const double length = cam_from_rig.translation.norm();
  const Eigen::Vector3d direction = cam_from_rig.translation / length +
                                    across_baseline(cam_from_rig.translation) * turns.tail<2>();
  const Rigid3 rebased(cam_from_rig.rotation, length * direction.normalized());
  return Rigid3(so3_exp(turns.head<3>()), Eigen::Vector3d::Zero()) * rebased;
}

}  // namespace waymark
