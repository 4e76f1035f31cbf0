// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/survey.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "waymark/geometry/damping.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/marker/square_pose.h"

namespace waymark {
namespace {

/// Views that hypotheses are made of, spread over all.
constexpr std::size_t kMaxSamples = 10;
constexpr int kSampleIterations = 8;
constexpr int kMaxIterations = 30;
/// A view fits when its corners are that near on the average: poses of the map have errors, too,
/// and these show with how large a marker appears.
constexpr double kFitPx = 2.0;
constexpr double kFitShare = 0.05;
/// Corners are not found better than this, whatever a few residuals say.
constexpr double kCornerSigmaPx = 0.15;
constexpr double kHuberPx = 1.0;
constexpr std::size_t kMinViews = 3;
/// Poses that differ by less are one.
constexpr double kSameNormalRad = 15.0 * std::numbers::pi / 180.0;
/// Of the two poses the worse one must be worse by this factor, and by this much.
constexpr double kClearlyWorse = 2.0;
constexpr double kClearlyWorsePx2 = 0.05;
/// Another place: off by that many sides of the marker.
constexpr double kOtherPlaceSides = 0.5;

using Views = std::vector<const MarkerView*>;

struct Equations {
  Matrix7d information = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();
  double cost = 0.0;
};

Rigid3 pose_in(const MarkerView& view, const Sim3& map_from_marker) {
  // Lengths in the camera by the side: of a square of side 1.
  const Rigid3& cam = view.cam_from_map;
  return {(cam.rotation * map_from_marker.rotation).normalized(),
          (cam * map_from_marker.translation) / map_from_marker.scale};
}

double squared_error(const MarkerView& view, const Sim3& map_from_marker) {
  return squared_error_px(*view.observation, pose_in(view, map_from_marker), 1.0);
}

bool fits(const MarkerView& view, const Sim3& map_from_marker) {
  const double limit = kFitPx + kFitShare * mean_side_px(*view.observation);
  return squared_error(view, map_from_marker) <= limit * limit;
}

/// Adds what one corner says of a change of the marker in its own frame, exp on the right.
void add_corner(const MarkerView& view,
                std::size_t i,
                const Sim3& map_from_marker,
                Equations& sum) {
  const MarkerObservation& observation = *view.observation;
  const Eigen::Vector3d corner = marker_corner(i, 1.0);
  const Eigen::Vector3d in_cam = view.cam_from_map * (map_from_marker * corner);
  const double range = std::max(in_cam.norm(), 1e-12);
  const Eigen::Vector3d direction = in_cam / range;
  const Eigen::Vector3d bearing = observation.bearings[i].cast<double>();
  if (direction.dot(bearing) <= 0.0) {
    sum.cost += 1e6;
    return;
  }
  const Matrix23d w = observation.pixel_from_bearing[i].cast<double>();
  const Eigen::Vector2d residual = w * (direction - bearing);
  const RobustValue robust = huber(residual.squaredNorm(), kHuberPx);
  sum.cost += robust.loss;
  Eigen::Matrix<double, 3, 7> by_change;
  by_change << Eigen::Matrix3d::Identity(), -skew(corner), corner;
  const Eigen::Matrix3d in_cam_by_corner =
      map_from_marker.scale * (view.cam_from_map.rotation * map_from_marker.rotation).matrix();
  const Eigen::Matrix<double, 2, 7> jacobian =
      (w - (w * direction) * direction.transpose()) / range * in_cam_by_corner * by_change;
  sum.information += robust.weight * jacobian.transpose() * jacobian;
  sum.gradient += robust.weight * jacobian.transpose() * residual;
}

Equations equations_of(const Views& views, const Sim3& map_from_marker) {
  Equations sum;
  for (const MarkerView* view : views) {
    for (std::size_t i = 0; i < 4; ++i) add_corner(*view, i, map_from_marker, sum);
  }
  return sum;
}

/// Levenberg-Marquardt; the equations are those of the result.
Equations refine(const Views& views, int max_iterations, Sim3& map_from_marker) {
  Equations now = equations_of(views, map_from_marker);
  TenfoldDamping damping;
  for (int i = 0; i < max_iterations && damping.is_below(1e8); ++i) {
    Matrix7d damped = now.information;
    damped.diagonal() *= damping.factor();
    damped.diagonal().array() += 1e-9;
    const Vector7d step = damped.ldlt().solve(-now.gradient);
    if (!step.allFinite() || step.norm() > 20.0) {
      damping.reject();
      continue;
    }
    const Sim3 candidate = map_from_marker * Sim3::exp(step);
    const Equations then = equations_of(views, candidate);
    if (!(then.cost < now.cost)) {
      damping.reject();
      continue;
    }
    const bool is_done = now.cost - then.cost < 1e-9 * now.cost;
    map_from_marker = candidate;
    now = then;
    damping.accept();
    if (is_done) break;
  }
  return now;
}

Eigen::Vector3d middle_bearing(const MarkerObservation& observation) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& bearing : observation.bearings) sum += bearing.cast<double>();
  return sum.normalized();
}

/// Units of the map per side of the marker, such that the middle lies where another view has it:
/// least squares of the distance of its ray.
std::optional<double> side_by(const MarkerView& view,
                              const Rigid3& cam_from_marker,
                              const MarkerView& other) {
  const Rigid3 other_from_cam = other.cam_from_map * view.cam_from_map.inverse();
  const Eigen::Vector3d ray = middle_bearing(*other.observation);
  const auto across = [&](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v - ray.dot(v) * ray);
  };
  const Eigen::Vector3d grows = across(other_from_cam.rotation * cam_from_marker.translation);
  const Eigen::Vector3d stays = across(other_from_cam.translation);
  if (!(grows.squaredNorm() > 1e-12)) return std::nullopt;
  const double side = -grows.dot(stays) / grows.squaredNorm();
  if (!(side > 0.0) || !std::isfinite(side)) return std::nullopt;
  return side;
}

Views spread(const Views& views, std::size_t max_count) {
  if (views.size() <= max_count) return views;
  Views chosen;
  for (std::size_t i = 0; i < max_count; ++i) {
    chosen.push_back(views[i * (views.size() - 1) / (max_count - 1)]);
  }
  return chosen;
}

Views fitting(const Views& views, const Sim3& map_from_marker) {
  Views chosen;
  for (const MarkerView* view : views) {
    if (fits(*view, map_from_marker)) chosen.push_back(view);
  }
  return chosen;
}

/// Images of a pair are of one moment.
std::size_t count_moments(const Views& views) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    count += i == 0 || views[i]->timestamp_ns != views[i - 1]->timestamp_ns;
  }
  return count;
}

struct Hypothesis {
  Sim3 map_from_marker;
  std::size_t num_fitting = 0;
  double cost = 0.0;
};

/// All that pairs of views suggest, the best first.
std::vector<Hypothesis> list_hypotheses(const Views& views) {
  std::vector<Hypothesis> hypotheses;
  const Views samples = spread(views, kMaxSamples);
  for (const MarkerView* view : samples) {
    for (const Rigid3& cam_from_marker : square_poses(*view->observation, 1.0)) {
      for (const MarkerView* other : samples) {
        if (other == view) continue;
        const auto side = side_by(*view, cam_from_marker, *other);
        if (!side) continue;
        const Rigid3 map_from_cam = view->cam_from_map.inverse();
        Hypothesis hypothesis;
        hypothesis.map_from_marker =
            Sim3(map_from_cam) *
            Sim3(cam_from_marker.rotation, *side * cam_from_marker.translation, *side);
        refine({view, other}, kSampleIterations, hypothesis.map_from_marker);
        const Views found = fitting(views, hypothesis.map_from_marker);
        hypothesis.num_fitting = found.size();
        hypothesis.cost = equations_of(found, hypothesis.map_from_marker).cost;
        if (hypothesis.num_fitting >= 2) hypotheses.push_back(hypothesis);
      }
    }
  }
  std::ranges::stable_sort(hypotheses, [](const Hypothesis& a, const Hypothesis& b) {
    return a.num_fitting != b.num_fitting ? a.num_fitting > b.num_fitting : a.cost < b.cost;
  });
  return hypotheses;
}

Eigen::Vector3d normal_of(const Sim3& map_from_marker) {
  return map_from_marker.rotation * Eigen::Vector3d::UnitZ();
}

/// Whether the views fit another pose nearly as well.
bool is_ambiguous(const Views& views,
                  const Sim3& best,
                  double best_cost,
                  std::span<const Hypothesis> hypotheses) {
  for (const Hypothesis& hypothesis : hypotheses) {
    Sim3 other = hypothesis.map_from_marker;
    const auto angle = [&] {
      return std::acos(std::clamp(normal_of(other).dot(normal_of(best)), -1.0, 1.0));
    };
    if (angle() < kSameNormalRad) continue;
    const double cost = refine(views, kMaxIterations, other).cost;
    if (angle() < kSameNormalRad) continue;
    const double least = kClearlyWorsePx2 * 4.0 * static_cast<double>(views.size());
    return cost < kClearlyWorse * best_cost + least;
  }
  return false;
}

/// Fits the hypothesis to all views that agree with it.
Views settle(const Views& views, Sim3& map_from_marker, Equations& equations) {
  Views chosen = fitting(views, map_from_marker);
  for (int round = 0; round < 3; ++round) {
    equations = refine(chosen, kMaxIterations, map_from_marker);
    Views again = fitting(views, map_from_marker);
    if (again == chosen) break;
    chosen = std::move(again);
  }
  return chosen;
}

void judge_other_places(const Views& others, const Views& chosen, SurveyedMarker& marker) {
  if (count_moments(others) < 2) return;
  for (const Hypothesis& hypothesis : list_hypotheses(others)) {
    const double off =
        (hypothesis.map_from_marker.translation - marker.map_from_marker.translation).norm() /
        marker.map_from_marker.scale;
    const double size = hypothesis.map_from_marker.scale / marker.map_from_marker.scale;
    if (off < kOtherPlaceSides || size < 0.5 || size > 2.0) continue;
    const Views there = fitting(others, hypothesis.map_from_marker);
    if (count_moments(there) < 2) continue;
    const auto later = [](const Views& a, const Views& b) {
      return a.front()->timestamp_ns > b.back()->timestamp_ns;
    };
    const bool is_in_turn = later(there, chosen) || later(chosen, there);
    marker.verdict = is_in_turn ? MarkerStatus::kMoved : MarkerStatus::kTwice;
    marker.changed_ns = std::max(there.front()->timestamp_ns, chosen.front()->timestamp_ns);
    return;
  }
}

/// Two of one number in an image are two markers, wherever they are.
bool is_twice_in_an_image(const Views& views) {
  for (std::size_t i = 1; i < views.size(); ++i) {
    if (views[i]->timestamp_ns == views[i - 1]->timestamp_ns &&
        views[i]->observation->camera == views[i - 1]->observation->camera) {
      return true;
    }
  }
  return false;
}

}  // namespace

SurveyedMarker survey_marker(int id, std::span<const MarkerView> all) {
  SurveyedMarker marker;
  marker.id = id;
  Views views;
  for (const MarkerView& view : all) views.push_back(&view);
  marker.num_views = count_moments(views);
  if (is_twice_in_an_image(views)) marker.verdict = MarkerStatus::kTwice;
  if (marker.num_views < kMinViews) return marker;
  const std::vector<Hypothesis> hypotheses = list_hypotheses(views);
  if (hypotheses.empty()) return marker;
  marker.map_from_marker = hypotheses.front().map_from_marker;
  Equations equations;
  const Views chosen = settle(views, marker.map_from_marker, equations);
  marker.num_fitting = count_moments(chosen);
  if (marker.num_fitting < kMinViews) return marker;
  const double num_residuals = 8.0 * static_cast<double>(chosen.size());
  const double sigma_px = std::sqrt(equations.cost / num_residuals);
  marker.rms_px = sigma_px;
  const Matrix7d covariance = equations.information.ldlt().solve(Matrix7d::Identity()) *
                              std::pow(std::max(sigma_px, kCornerSigmaPx), 2);
  marker.side_sigma = covariance(6, 6) > 0.0 ? std::sqrt(covariance(6, 6)) : 1.0;
  if (marker.verdict == MarkerStatus::kTwice) return marker;
  Views others;
  for (const MarkerView* view : views) {
    if (std::ranges::find(chosen, view) == chosen.end()) others.push_back(view);
  }
  if (is_ambiguous(chosen, marker.map_from_marker, equations.cost, hypotheses)) return marker;
  marker.verdict = MarkerStatus::kSound;
  judge_other_places(others, chosen, marker);
  return marker;
}

}  // namespace waymark
