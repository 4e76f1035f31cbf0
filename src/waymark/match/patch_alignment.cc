// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/patch_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "waymark/base/median.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/image/convert.h"
#include "waymark/image/sample.h"
#include "waymark/image/small_image.h"
#include "waymark/match/correlation.h"

namespace waymark {
namespace {

constexpr std::size_t kNumPatchLevels = 3;
constexpr int kMaxPatchSteps = 10;
/// More tell hardly more, and take longer.
constexpr std::size_t kMaxPatches = 800;
/// A patch has 5 x 5 pixels.
constexpr int kRadius = 2;
constexpr std::size_t kPatchPixels = (2 * kRadius + 1) * (2 * kRadius + 1);
/// In pixels of the level.
constexpr double kSmallStep = 0.02;
/// Grey values are off by so much at least, by noise and since patches are no planes.
constexpr float kMinErrorGrey = 1.0f;
/// A step is damped as if the pose were known to so many radians and parts of the distance.
constexpr double kStepSigma = 0.2;
/// Of the gain, around 1.
constexpr double kGainSigma = 0.2;

/// Of a point's own patch, and its variance in grey values squared.
constexpr double kMinCorrelation = 0.7;
constexpr double kMinVariance = 0.5;
/// Points are spread, one for each square of this side.
constexpr int kCellPx = 16;

/// The derivative of exp(xi) * point by xi.
Eigen::Matrix<double, 3, 6> moved_by(const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 3, 6> by;
  by << Eigen::Matrix3d::Identity(), -skew(point);
  return by;
}

/// Whether both vary by more than noise.
bool has_contrast(const Correlation& pairs, double min_variance) {
  return pairs.scatter_a() > min_variance * pairs.n && pairs.scatter_b() > min_variance * pairs.n;
}

}  // namespace

void PatchAligner::build_levels(const std::shared_ptr<const Camera>& camera) {
  if (camera_ == camera) return;
  camera_ = camera;
  levels_.clear();
  double factor = detail_factor(camera->width_px(), camera->height_px());
  for (std::size_t i = 0; i < kNumPatchLevels; ++i, factor *= 0.5) {
    levels_.emplace_back(camera_, factor);
  }
}

void PatchAligner::choose_candidates(std::span<const Eigen::Vector3d> points_in_a) {
  pixels_.resize(points_in_a.size()), is_seen_.resize(points_in_a.size());
  levels_[0].project(points_in_a, pixels_, is_seen_);
  const auto num_seen = static_cast<std::size_t>(
      std::ranges::count_if(is_seen_, [](std::uint8_t is_seen) { return is_seen != 0; }));
  const std::size_t stride = 1 + num_seen / kMaxPatches;
  candidates_.clear();
  std::size_t count = 0;
  for (std::size_t i = 0; i < points_in_a.size(); ++i) {
    if (is_seen_[i] && count++ % stride == 0) candidates_.push_back(static_cast<std::uint32_t>(i));
  }
}

void PatchAligner::choose_points(std::size_t index, std::span<const Eigen::Vector3d> points_in_a) {
  const Image& image = a_[index];
  const bool wraps = levels_[index].wrap_width_px() > 0.0;
  points_ = {};
  patches_ = {};
  std::vector<Eigen::Vector3d> points;
  for (const std::uint32_t i : candidates_) points.push_back(points_in_a[i]);
  pixels_.resize(points.size()), is_seen_.resize(points.size());
  levels_[index].project(points, pixels_, is_seen_);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto x0 = static_cast<int>(std::lround(pixels_[i].x()));
    const auto y0 = static_cast<int>(std::lround(pixels_[i].y()));
    const int margin = kRadius + 1;
    if (!is_seen_[i] || y0 < margin || y0 + margin >= image.height_px) continue;
    if (!wraps && (x0 < margin || x0 + margin >= image.width_px)) continue;
    patches_.indices.push_back(candidates_[i]);
    patches_.ranges.push_back(points[i].norm());
    for (int y = y0 - kRadius; y <= y0 + kRadius; ++y) {
      for (int x = x0 - kRadius; x <= x0 + kRadius; ++x) {
        patches_.pixels.emplace_back((x + image.width_px) % image.width_px, y);
      }
    }
  }
  linearize(index);
  if (!patches_.ranges.empty()) range_ = median(patches_.ranges);
  const std::size_t count = points_.points.size();
  moved_.resize(count), pixels_.resize(count), is_seen_.resize(count), seen_greys_.resize(count);
}

/// Patches that reach beyond what the lens shows are left out.
void PatchAligner::linearize(std::size_t index) {
  const std::size_t count = patches_.pixels.size();
  bearings_.resize(count), pixels_.resize(count), is_seen_.resize(count);
  pixel_from_point_.resize(count);
  std::vector<std::uint8_t> has_bearing(count);
  levels_[index].unproject(patches_.pixels, bearings_, has_bearing);
  for (std::size_t k = 0; k < count; ++k) {
    // What has no bearing is not seen either.
    bearings_[k] = has_bearing[k]
                       ? Eigen::Vector3d(patches_.ranges[k / kPatchPixels] * bearings_[k])
                       : Eigen::Vector3d(0.0, 0.0, 1.0);
  }
  levels_[index].project_with_jacobian(bearings_, pixels_, pixel_from_point_, is_seen_);
  for (std::size_t i = 0; i < patches_.indices.size(); ++i) {
    bool is_whole = true;
    for (std::size_t k = i * kPatchPixels; k < (i + 1) * kPatchPixels; ++k) {
      is_whole = is_whole && has_bearing[k] && is_seen_[k] && pixel_from_point_[k].allFinite();
    }
    if (is_whole) add_patch(index, i);
  }
}

/// Without the means of its grey values and gradients.
void PatchAligner::add_patch(std::size_t index, std::size_t patch) {
  const Image& image = a_[index];
  const int width = image.width_px;
  points_.indices.push_back(patches_.indices[patch]);
  Vector6d mean_gradient = Vector6d::Zero();
  float mean_grey = 0.0f;
  for (std::size_t k = patch * kPatchPixels; k < (patch + 1) * kPatchPixels; ++k) {
    const auto x = static_cast<int>(patches_.pixels[k].x());
    const auto y = static_cast<int>(patches_.pixels[k].y());
    const std::uint8_t* const row = image.row(y);
    const Eigen::RowVector2d slope(0.5 * (row[(x + 1) % width] - row[(x + width - 1) % width]),
                                   0.5 * (image.row(y + 1)[x] - image.row(y - 1)[x]));
    const Eigen::Matrix<double, 2, 6> pixel_by = pixel_from_point_[k] * moved_by(bearings_[k]);
    points_.points.push_back(bearings_[k]);
    points_.pixel_by_motion.push_back(pixel_by);
    points_.gradients.push_back((slope * pixel_by).transpose());
    points_.greys.push_back(row[x]);
    mean_gradient += points_.gradients.back() / static_cast<double>(kPatchPixels);
    mean_grey += points_.greys.back() / static_cast<float>(kPatchPixels);
  }
  for (std::size_t k = points_.points.size() - kPatchPixels; k < points_.points.size(); ++k) {
    points_.gradients[k] -= mean_gradient;
    points_.greys[k] -= mean_grey;
  }
}

void PatchAligner::look(std::size_t index, const Rigid3& b_from_a) {
  const ScaledCamera& camera = levels_[index];
  for (std::size_t k = 0; k < moved_.size(); ++k) moved_[k] = b_from_a * points_.points[k];
  camera.project(moved_, pixels_, is_seen_);
  const bool wraps = camera.wrap_width_px() > 0.0;
  for (std::size_t k = 0; k < moved_.size(); ++k) {
    seen_greys_[k] = is_seen_[k] ? sample(b_[index], pixels_[k], wraps) : 0.0f;
  }
  centre();
}

/// What is left of the patches' grey values without each one's mean.
void PatchAligner::centre() {
  for (std::size_t first = 0; first < seen_greys_.size(); first += kPatchPixels) {
    const auto seen = std::span(is_seen_).subspan(first, kPatchPixels);
    if (std::ranges::count(seen, 0) > 0) std::ranges::fill(seen, std::uint8_t{0});
    Eigen::Map<Eigen::ArrayXf> greys(&seen_greys_[first], kPatchPixels);
    greys -= greys.mean();
  }
}

double PatchAligner::mean_shift_px(const Vector6d& motion) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < points_.points.size(); k += kPatchPixels) {
    sum += (points_.pixel_by_motion[k] * motion).norm();
  }
  return sum / static_cast<double>(points_.indices.size());
}

double PatchAligner::step(PatchAlignment& alignment) {
  errors_.clear();
  const auto gain = static_cast<float>(alignment.gain);
  const auto error = [&](std::size_t k) { return seen_greys_[k] - gain * points_.greys[k]; };
  for (std::size_t k = 0; k < seen_greys_.size(); ++k) {
    if (is_seen_[k]) errors_.push_back(std::abs(error(k)));
  }
  if (errors_.empty()) return 0.0;
  const float sigma = std::max(kMinErrorGrey, kSigmaOfMedian * median(errors_));
  const float limit = kHuberSigmas95 * sigma;
  using Vector7d = Eigen::Vector<double, 7>;
  Vector7d unit = Vector7d::Ones();
  unit.head<3>().setConstant(range_);  // So that lengths are of the size of angles.
  Eigen::Matrix<double, 7, 7> hessian = Eigen::Matrix<double, 7, 7>::Zero();
  hessian.diagonal().head<6>().setConstant(std::pow(sigma / kStepSigma, 2));
  hessian(6, 6) = std::pow(sigma / kGainSigma, 2);
  Vector7d gradient = Vector7d::Zero();
  gradient[6] = hessian(6, 6) * (1.0 - alignment.gain);
  for (std::size_t k = 0; k < seen_greys_.size(); ++k) {
    if (!is_seen_[k]) continue;
    Vector7d jacobian;
    jacobian << alignment.gain * points_.gradients[k], points_.greys[k];
    jacobian.array() *= unit.array();
    const float e = error(k);
    const double weight = huber_weight(e, limit);
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(jacobian, weight);
    gradient += weight * e * jacobian;
  }
  const Vector7d change =
      unit.cwiseProduct(hessian.selfadjointView<Eigen::Lower>().ldlt().solve(gradient));
  if (!change.allFinite()) return 0.0;
  const Vector6d motion = change.head<6>();
  alignment.b_from_a = alignment.b_from_a * Rigid3::exp(-motion);
  alignment.gain += change[6];
  Eigen::Matrix<double, 7, 7> full = hessian.selfadjointView<Eigen::Lower>();
  full.array() *= (unit.cwiseInverse() * unit.cwiseInverse().transpose()).array();
  information_ = full.topLeftCorner<6, 6>() / (sigma * sigma);
  return mean_shift_px(motion);
}

void PatchAligner::judge(PatchAlignment& alignment) {
  Correlation pairs;
  for (std::size_t k = 0; k < seen_greys_.size(); ++k) {
    if (is_seen_[k]) pairs.add(points_.greys[k], seen_greys_[k]);
  }
  if (!has_contrast(pairs, 0.0)) return;
  alignment.correlation = pairs.coefficient();
  choose_alike(alignment);
  const Matrix6d in_a = information_.ldlt().solve(Matrix6d::Identity());
  double sum = 0.0;
  for (std::size_t k = 0; k < points_.points.size(); k += kPatchPixels) {
    const Eigen::Matrix<double, 2, 6>& by = points_.pixel_by_motion[k];
    sum += (by * in_a * by.transpose()).trace();
  }
  const auto count = static_cast<double>(points_.points.size() / kPatchPixels);
  alignment.pixel_sigma = std::sqrt(sum / count);
  const Matrix6d adjoint = alignment.b_from_a.adjoint();
  alignment.covariance = adjoint * in_a * adjoint.transpose();
}

/// The most alike of each cell of the image.
void PatchAligner::choose_alike(PatchAlignment& alignment) const {
  const int columns = b_[0].width_px / kCellPx + 1;
  const int rows = b_[0].height_px / kCellPx + 1;
  struct Best {
    double correlation = kMinCorrelation;
    std::optional<std::uint32_t> index;
  };
  std::vector<Best> best(static_cast<std::size_t>(columns * rows));
  for (std::size_t i = 0; i < points_.indices.size(); ++i) {
    const std::size_t first = i * kPatchPixels;
    if (!is_seen_[first]) continue;
    Correlation pairs;
    for (std::size_t k = first; k < first + kPatchPixels; ++k) {
      pairs.add(points_.greys[k], seen_greys_[k]);
    }
    const Eigen::Vector2d& pixel = pixels_[first + kPatchPixels / 2];
    const int column = std::clamp(static_cast<int>(pixel.x()) / kCellPx, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(pixel.y()) / kCellPx, 0, rows - 1);
    Best& cell = best[static_cast<std::size_t>(row * columns + column)];
    const double correlation = has_contrast(pairs, kMinVariance) ? pairs.coefficient() : 0.0;
    if (correlation > cell.correlation) cell = {correlation, points_.indices[i]};
  }
  for (const Best& cell : best) {
    if (cell.index) alignment.alike.push_back(*cell.index);
  }
  std::ranges::sort(alignment.alike);
}

PatchAlignment PatchAligner::align(const std::shared_ptr<const Camera>& camera,
                                   const Image& a,
                                   std::span<const Eigen::Vector3d> points_in_a,
                                   const Image& b,
                                   const Rigid3& initial_b_from_a) {
  PatchAlignment alignment;
  alignment.b_from_a = initial_b_from_a;
  information_.setZero();
  build_levels(camera);
  a_.assign(1, a);
  b_.assign(1, b);
  while (a_.size() < kNumPatchLevels) {
    a_.push_back(reduce(a_.back().view(), 0.5));
    b_.push_back(reduce(b_.back().view(), 0.5));
  }
  choose_candidates(points_in_a);
  for (std::size_t level = kNumPatchLevels; level-- > 0;) {
    choose_points(level, points_in_a);
    if (points_.points.empty()) return alignment;
    for (int i = 0; i < kMaxPatchSteps; ++i) {
      look(level, alignment.b_from_a);
      if (step(alignment) < kSmallStep) break;
    }
  }
  look(0, alignment.b_from_a);
  judge(alignment);
  return alignment;
}

}  // namespace waymark
