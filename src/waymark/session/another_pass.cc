// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/another_pass.h"

#include <algorithm>
#include <cmath>

namespace waymark {
namespace {

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

}  // namespace

double image_shift(const Rig& before, const Rig& after) {
  double largest = 0.0;
  for (std::size_t c = 0; c < before.cameras.size(); ++c) {
    largest = std::max(largest, camera_shift(before.cameras[c], after.cameras[c]));
  }
  return largest;
}

std::optional<CameraChain> calibration_for_another_pass(const Session& session) {
  const InputInfo& info = session.input->info();
  const std::shared_ptr<const Rig> rig = session.system->rig();
  if (info.is_live || session.estimated || image_shift(session.rig, *rig) < kMinShift) {
    return std::nullopt;
  }
  const std::optional<CameraChain> found = chain_of(*rig, {});
  if (!found) return std::nullopt;
  CameraChain chain = *info.calibration;
  chain.cameras = found->cameras;
  return chain;
}

std::vector<CalibrationEstimate> join_passes(std::span<const CalibrationEstimate> first,
                                             std::vector<CalibrationEstimate> second) {
  if (second.empty()) return {first.begin(), first.end()};
  for (CalibrationEstimate& estimate : second) {
    const auto before = std::ranges::find(first, estimate.name, &CalibrationEstimate::name);
    if (before == first.end()) continue;
    estimate.given = before->given;
    estimate.given_sigma = before->given_sigma;
    estimate.change += before->change;
  }
  return second;
}

}  // namespace waymark
