// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/second_pass.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/calibrate/missing_distortion.h"

namespace waymark {
namespace {

constexpr const char* kMissingDistortion =
    "calibration: the images contradict a lens without distortion, as the stated zeros say: they "
    "are taken as unknown";
/// Distortions larger than this were not left out for being small.
constexpr double kLargeDistortion = 0.1;

/// A focal length that is 3 % off, or distortion that was left out. Less is mended well enough when
/// the map is, and does not pay for the time.
constexpr double kMinShift = 0.01;
constexpr int kGridSize = 16;

double camera_shift(const RigCamera& before, const RigCamera& after) {
  const Camera& camera = *before.camera;
  std::vector<Eigen::Vector2d> pixels;
  for (int row = 0; row < kGridSize; ++row) {
    for (int column = 0; column < kGridSize; ++column) {
      pixels.emplace_back((column + 0.5) / kGridSize * camera.width_px(),
                          (row + 0.5) / kGridSize * camera.height_px());
    }
  }
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size()), is_visible(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  const Eigen::Quaterniond turn =
      after.cam_from_rig.rotation * before.cam_from_rig.rotation.conjugate();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    bearings[i] = is_valid[i] ? turn * bearings[i] : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  }
  std::vector<Eigen::Vector2d> moved(pixels.size());
  after.camera->project(bearings, moved, is_visible);
  double sum = 0.0;
  double count = 1.0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!is_valid[i] || !is_visible[i]) continue;
    sum += (moved[i] - pixels[i]).squaredNorm();
    ++count;
  }
  return std::sqrt(sum / count) / camera.width_px();
}

/// Whether nothing but zeros is said of the distortion of a perspective camera, and not that they
/// are exact.
bool is_said_to_be_ideal(const ChainCamera& camera) {
  const CameraDescription& description = camera.description;
  const auto is_zero = [](double value) { return value == 0.0; };
  return description.camera_model == "pinhole" &&
         (description.distortion_model == "none" || description.distortion_model == "radtan") &&
         std::ranges::all_of(description.distortion_coeffs, is_zero) &&
         std::ranges::none_of(camera.sigmas.distortion_coeffs, is_zero);
}

/// With stereo or depth the map is straight enough to mend the calibration by itself.
std::optional<ChainCamera> with_missing_distortion(const Session& session) {
  const InputInfo& info = session.input->info();
  ChainCamera camera = info.calibration->cameras.front();
  if (info.setup != Setup::kMono || !session.settings.calibration.is_refined() ||
      !is_said_to_be_ideal(camera)) {
    return std::nullopt;
  }
  const auto found = find_missing_distortion(match_keyframes(*session.system->map()),
                                             camera.description,
                                             *session.system->rig()->cameras[0].camera);
  if (!found) return std::nullopt;
  camera.description = *found;
  camera.sigmas.distortion_coeffs = {0.1, 0.1, 5e-4, 5e-4};
  return camera;
}

}  // namespace

double image_shift(const Rig& before, const Rig& after) {
  double largest = 0.0;
  for (std::size_t c = 0; c < before.cameras.size(); ++c) {
    largest = std::max(largest, camera_shift(before.cameras[c], after.cameras[c]));
  }
  return largest;
}

std::optional<SecondPass> calibration_for_second_pass(const Session& session) {
  const InputInfo& info = session.input->info();
  if (info.is_live || session.estimated) return std::nullopt;
  SecondPass pass{*info.calibration, session.system->rig()->inverse_depth_offset};
  if (const auto distorted = with_missing_distortion(session)) {
    pass.calibration.cameras[0] = *distorted;
    pass.mistake = kMissingDistortion;
  } else {
    const std::shared_ptr<const Rig> rig = session.system->rig();
    const auto found =
        image_shift(session.rig, *rig) < kMinShift ? std::nullopt : chain_of(*rig, {});
    if (!found) return std::nullopt;
    pass.calibration.cameras = found->cameras;
    const std::vector<double>& coeffs = found->cameras[0].description.distortion_coeffs;
    if (is_said_to_be_ideal(info.calibration->cameras[0]) && !coeffs.empty() &&
        std::abs(coeffs[0]) > kLargeDistortion) {
      pass.mistake = kMissingDistortion;
    }
  }
  pass.calibration = session.input->of_unchanged_images(std::move(pass.calibration));
  return pass;
}

std::vector<CalibrationEstimate> join_passes(std::span<const CalibrationEstimate> first,
                                             std::vector<CalibrationEstimate> second) {
  for (const CalibrationEstimate& before : first) {
    const auto after = std::ranges::find(second, before.name, &CalibrationEstimate::name);
    if (after == second.end()) {
      second.push_back(before);
      continue;
    }
    after->given = before.given;
    after->given_sigma = before.given_sigma;
    after->change += before.change;
  }
  return second;
}

}  // namespace waymark
