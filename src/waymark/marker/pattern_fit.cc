// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/pattern_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/marker/pattern_drawing.h"

namespace waymark {
namespace {

/// From coarse to fine: the image is blurred more, and the drawing with it, so that it pulls from
/// further away.
constexpr std::array<double, 2> kFirstBlursPx = {1.6, 0.8};
constexpr double kUsualBlurPx = 0.6;  ///< Of an image as it is.
constexpr int kFirstSteps = 4;
/// How much an image may be blurred; that which fits best.
constexpr std::array<double, 4> kBlursPx = {0.25, 0.6, 1.0, 1.5};
constexpr int kLastSteps = 3;
/// What is expected is that right: across in pixels, the distance as a part of it, and turns. Where
/// few pixels leave a turn open it stays as expected.
constexpr double kExpectedPx = 2.0;
constexpr double kExpectedDistance = 0.05;
constexpr double kExpectedTurnRad = 0.1;
constexpr double kNoise = 3.0;       ///< Of grey values, with what the drawing lacks.
constexpr double kMostChange = 0.4;  ///< At once: in sides, radians, or of the distance.
constexpr std::size_t kLeastPixels = 12;
constexpr double kLeastContrast = 12.0;
constexpr double kLeastCorrelation = 0.85;
/// Numbers that are drawn in place of the own one.
constexpr int kNumOthers = 24;
/// Of what the best of these leaves unexplained: so much at most for the own one.
constexpr double kOwnShare = 0.5;

using Column = Eigen::Matrix<double, 9, 1>;
using Normal = Eigen::Matrix<double, 9, 9>;

/// Grey values of black, of what lies beyond the white, and of white.
using Levels = Eigen::Vector3d;

/// Of a side that is seen from straight before it, in pixels.
double side_px(const MarkerPatch& patch, const Rigid3& cam_from_marker) {
  const std::size_t middle = patch.tangents.level_pixel_from_bearing.size() / 2 +
                             static_cast<std::size_t>(patch.width) / 2;
  const Matrix23f& w = patch.tangents.level_pixel_from_bearing[middle];
  return std::max(1.0,
                  w.cast<double>().norm() / std::sqrt(2.0) / cam_from_marker.translation.norm());
}

/// Moves of a marker that show about as much as each other: by a side across the line of sight, and
/// along it as far as makes it so much larger.
Eigen::Matrix3d directions_of(const Eigen::Vector3d& translation) {
  const Eigen::Vector3d ahead = translation.normalized();
  const Eigen::Vector3d across = ahead.unitOrthogonal();
  Eigen::Matrix3d directions;
  directions << across, ahead.cross(across), translation;
  return directions;
}

/// Changed by such moves, then turned about its middle.
Rigid3 changed(const Rigid3& cam_from_marker, const Vector6d& change) {
  const Eigen::Vector3d move = directions_of(cam_from_marker.translation) * change.head<3>();
  return {(cam_from_marker.rotation * so3_exp(change.tail<3>())).normalized(),
          cam_from_marker.translation + move};
}

/// What all pixels of a marker and its white say.
struct PatternEquations {
  Normal information = Normal::Zero();
  Column gradient = Column::Zero();
  double sum = 0.0;
  double sum_squares = 0.0;
  double cost = 0.0;  ///< With the levels given.
  std::size_t num_pixels = 0;
};

PatternEquations equations_of(const MarkerPatch& patch,
                              const PatternDrawing& drawing,
                              const MarkerFamily& family,
                              const Rigid3& cam_from_marker,
                              const Levels& levels) {
  const Rigid3 marker_from_cam = cam_from_marker.inverse();
  const Eigen::Matrix3d rotation = cam_from_marker.rotation.matrix();
  const Eigen::Matrix3d move = directions_of(cam_from_marker.translation);
  const double quiet = quiet_share(family);
  PatternEquations equations;
  for (int y = 0; y < patch.height; ++y) {
    for (int x = 0; x < patch.width; ++x) {
      const auto i = static_cast<std::size_t>(y * patch.width + x);
      if (!patch.tangents.is_valid[i]) continue;
      const Eigen::Vector3d bearing = patch.tangents.bearings[i].cast<double>();
      const PlaneMeeting at = meet_plane(marker_from_cam, bearing);
      const double off = std::max(std::abs(at.u - 0.5), std::abs(at.v - 0.5));
      if (!at.is_ahead || off > 0.5 + quiet) continue;
      const DrawnSample black = sample_at(drawing.black, x, y);
      const DrawnSample outside = sample_at(drawing.outside, x, y);
      const Eigen::Vector3d point(at.u - 0.5, 0.5 - at.v, 0.0);
      Eigen::Matrix<double, 3, 6> point_by_change;
      point_by_change << move, -rotation * skew(point);
      const Matrix23d w = patch.tangents.level_pixel_from_bearing[i].cast<double>();
      const Eigen::Matrix<double, 2, 6> pixel_by_change = w / at.range * point_by_change;
      const Eigen::RowVector2d slope =
          (levels[0] - levels[2]) * black.slope + (levels[1] - levels[2]) * outside.slope;
      Column row;
      row << -(slope * pixel_by_change).transpose(), black.value, outside.value,
          1.0 - black.value - outside.value;
      const double grey = patch.grey.values[i];
      const double residual = grey - levels.dot(row.tail<3>());
      equations.information += row * row.transpose();
      equations.gradient += row * residual;
      equations.cost += residual * residual;
      equations.sum += grey;
      equations.sum_squares += grey * grey;
      ++equations.num_pixels;
    }
  }
  return equations;
}

/// Where a marker is by now, and its grey values.
struct FitState {
  Rigid3 cam_from_marker;
  Levels levels = Levels::Zero();
  PatternEquations equations;
  Vector6d moved = Vector6d::Zero();    ///< From where it was expected, in sum.
  Vector6d weights = Vector6d::Zero();  ///< Of what was expected.
};

/// A marker that is expected somewhere; side_px: how large.
FitState expect(const Rigid3& cam_from_marker, double side_px) {
  const double across = kExpectedPx / side_px;
  Vector6d sigmas;
  sigmas << across, across, kExpectedDistance, Eigen::Vector3d::Constant(kExpectedTurnRad);
  FitState state;
  state.cam_from_marker = cam_from_marker;
  state.weights = (kNoise / sigmas.array()).square();
  return state;
}

/// Brings the equations up to date, the levels being those that fit best.
bool weigh(const MarkerPatch& patch,
           const MarkerFamily& family,
           const PatternDrawing& drawing,
           FitState& state) {
  for (int round = 0; round < 2; ++round) {
    state.equations = equations_of(patch, drawing, family, state.cam_from_marker, state.levels);
    if (state.equations.num_pixels < kLeastPixels) return false;
    if (round == 1) break;
    Eigen::Matrix3d information = state.equations.information.bottomRightCorner<3, 3>();
    information.diagonal().array() += 1e-3;
    state.levels += information.ldlt().solve(state.equations.gradient.tail<3>());
    if (!state.levels.allFinite()) return false;
  }
  return true;
}

bool step(const MarkerPatch& patch,
          const MarkerFamily& family,
          const std::vector<std::uint8_t>& modules,
          double blur_px,
          FitState& state) {
  const PatternDrawing drawing =
      draw_pattern(patch, modules, family, state.cam_from_marker, blur_px);
  if (!weigh(patch, family, drawing, state)) return false;
  Normal information = state.equations.information;
  Column gradient = state.equations.gradient;
  information.diagonal().array() += 1e-3;
  information.diagonal().head<6>() += state.weights;
  gradient.head<6>() -= state.weights.cwiseProduct(state.moved);
  const Column solved = information.ldlt().solve(gradient);
  if (!solved.allFinite()) return false;
  Vector6d change = solved.head<6>();
  change *= std::min(1.0, kMostChange / std::max(change.norm(), 1e-12));
  state.cam_from_marker = changed(state.cam_from_marker, change);
  state.moved += change;
  return state.cam_from_marker.translation.allFinite();
}

PatternFit fit_of(const FitState& state) {
  const PatternEquations& equations = state.equations;
  const auto count = static_cast<double>(equations.num_pixels);
  const double total = equations.sum_squares - equations.sum * equations.sum / count;
  PatternFit fit;
  fit.cam_from_marker = state.cam_from_marker;
  fit.contrast = state.levels[2] - state.levels[0];
  fit.least_squares = equations.cost / count;
  fit.correlation = total > 0.0 ? std::sqrt(std::max(0.0, 1.0 - equations.cost / total)) : 0.0;
  return fit;
}

}  // namespace

std::optional<PatternFit> fit_pattern(ImageView image,
                                      const Camera& camera,
                                      const MarkerFamily& family,
                                      int id,
                                      const Rigid3& cam_from_marker) {
  std::optional<MarkerPatch> patch = look_at_marker(image, camera, family, cam_from_marker);
  if (!patch) return std::nullopt;
  const std::vector<std::uint8_t> modules = family.modules(id);
  FitState start = expect(cam_from_marker, side_px(*patch, cam_from_marker));
  const DenseImage sharp = patch->grey;
  for (const double blur_px : kFirstBlursPx) {
    patch->grey = sharp;
    blur_image(patch->grey, blur_px);
    for (int i = 0; i < kFirstSteps; ++i) {
      if (!step(*patch, family, modules, std::hypot(blur_px, kUsualBlurPx), start)) {
        return std::nullopt;
      }
    }
  }
  patch->grey = sharp;
  std::optional<PatternFit> best;
  for (const double blur_px : kBlursPx) {
    FitState state = start;
    bool is_sound = true;
    for (int i = 0; i < kLastSteps && is_sound; ++i) {
      is_sound = step(*patch, family, modules, blur_px, state);
    }
    if (!is_sound) continue;
    const PatternDrawing drawing =
        draw_pattern(*patch, modules, family, state.cam_from_marker, blur_px);
    if (!weigh(*patch, family, drawing, state)) continue;
    PatternFit fit = fit_of(state);
    fit.blur_px = blur_px;
    if (!best || fit.least_squares < best->least_squares) best = fit;
  }
  return best;
}

bool is_own_pattern(ImageView image,
                    const Camera& camera,
                    const MarkerFamily& family,
                    int id,
                    const PatternFit& fit) {
  if (fit.contrast < kLeastContrast || fit.correlation < kLeastCorrelation) return false;
  const auto patch = look_at_marker(image, camera, family, fit.cam_from_marker);
  if (!patch) return false;
  const int num_others = std::min(kNumOthers, family.size() - 1);
  double least = 1e30;
  for (int k = 1; k <= num_others; ++k) {
    const int other = (id + k * family.size() / (num_others + 1)) % family.size();
    if (other == id) continue;
    FitState state;
    state.cam_from_marker = fit.cam_from_marker;
    const PatternDrawing drawing =
        draw_pattern(*patch, family.modules(other), family, fit.cam_from_marker, fit.blur_px);
    if (!weigh(*patch, family, drawing, state)) return false;
    least = std::min(least, fit_of(state).least_squares);
  }
  return fit.least_squares <= kOwnShare * least;
}

}  // namespace waymark
