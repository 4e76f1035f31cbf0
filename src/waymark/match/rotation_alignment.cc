// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/rotation_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/median.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/robust_loss.h"
#include "waymark/image/convert.h"
#include "waymark/image/sample.h"
#include "waymark/match/correlation.h"

namespace waymark {
namespace {

constexpr std::size_t kNumLevels = 3;
constexpr std::size_t kCoarsest = kNumLevels - 1;
/// Turns that are tried first, in either direction, and at most so much of the field of view.
constexpr double kMaxTrialRad = 70.0 / 180.0 * std::numbers::pi;
constexpr double kMaxTrialPart = 0.7;
/// Of the points both images must show.
constexpr double kMinOverlap = 0.25;
constexpr std::size_t kNumRefined = 3;
constexpr int kMaxSteps = 8;
/// Fewer tell nothing.
constexpr double kMinPixels = 10.0;

SmallImage halved(const SmallImage& image) {
  SmallImage half;
  half.grey = reduce(image.grey.view(), 0.5);
  if (!image.mask.values.empty()) half.mask = pick_reduced(image.mask.view(), 0.5);
  return half;
}

/// Of the pixel that a point lies in, row by row.
std::int16_t index_of(const Eigen::Vector2d& point, int width_px) {
  const int x = static_cast<int>(point.x() + 0.5);
  const int y = static_cast<int>(point.y() + 0.5);
  return static_cast<std::int16_t>(y * width_px + x);
}

}  // namespace

Eigen::Vector3d gradient_by_turn(const Eigen::Vector3d& bearing,
                                 const Matrix23d& pixel_from_bearing,
                                 const Eigen::Vector2d& slope) {
  return bearing.cross(pixel_from_bearing.transpose() * slope);
}

void RotationAligner::set_camera(const std::shared_ptr<const Camera>& camera) {
  if (camera_ == camera) return;
  camera_ = camera;
  levels_.clear();
  trials_.clear();
  build_levels();
  build_trials();
}

void RotationAligner::build_levels() {
  double factor = small_image_factor(camera_->width_px(), camera_->height_px());
  for (std::size_t i = 0; i < kNumLevels; ++i, factor *= 0.5) {
    Level level{ScaledCamera(camera_, factor), {}, {}, {}};
    std::vector<Eigen::Vector2d> pixels;
    for (int y = 0; y < level.camera.height_px(); ++y) {
      for (int x = 0; x < level.camera.width_px(); ++x) pixels.emplace_back(x, y);
    }
    std::vector<std::uint8_t> is_valid(pixels.size()), is_visible(pixels.size());
    level.bearings.resize(pixels.size());
    level.pixel_from_bearing.resize(pixels.size());
    level.camera.unproject(pixels, level.bearings, is_valid);
    level.camera.project_with_jacobian(
        level.bearings, pixels, level.pixel_from_bearing, is_visible);
    const double pixel_rad = central_pixel_angle(level.camera);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      const Matrix23d& jacobian = level.pixel_from_bearing[k];
      const double pixels_per_angle =
          Eigen::Vector3d(jacobian.row(0)).cross(Eigen::Vector3d(jacobian.row(1))).norm();
      const bool is_usable = is_valid[k] && is_visible[k] && std::isfinite(pixels_per_angle);
      const double part = 1.0 / std::max(1.0, pixels_per_angle * pixel_rad * pixel_rad);
      level.weights.push_back(is_usable ? static_cast<float>(part) : 0.0f);
    }
    levels_.push_back(std::move(level));
  }
}

void RotationAligner::build_trials() {
  const Level& from = levels_[kCoarsest];
  const ScaledCamera& to = levels_[kCoarsest - 1].camera;
  const double interval = central_pixel_angle(from.camera);
  const auto num_trials = [&](int size_px) {
    return static_cast<int>(std::min(kMaxTrialRad / interval, kMaxTrialPart * size_px));
  };
  const int num_yaw = num_trials(from.camera.width_px());
  const int num_pitch = num_trials(from.camera.height_px());
  const std::size_t count = from.bearings.size();
  turned_.resize(count), pixels_.resize(count), is_seen_.resize(count);
  for (int pitch = -num_pitch; pitch <= num_pitch; ++pitch) {
    for (int yaw = -num_yaw; yaw <= num_yaw; ++yaw) {
      Trial trial{so3_exp({interval * pitch, interval * yaw, 0.0}), {}};
      for (std::size_t i = 0; i < count; ++i) turned_[i] = trial.turn * from.bearings[i];
      to.project(turned_, pixels_, is_seen_);
      for (std::size_t i = 0; i < count; ++i) {
        trial.pixels.push_back(is_seen_[i] ? index_of(pixels_[i], to.width_px())
                                           : std::int16_t{-1});
      }
      trials_.push_back(std::move(trial));
    }
  }
}

void RotationAligner::set_images(const SmallImage& a, const SmallImage& b) {
  a_.assign(1, a);
  b_.assign(1, b);
  while (a_.size() < kNumLevels) {
    a_.push_back(halved(a_.back()));
    b_.push_back(halved(b_.back()));
  }
}

void RotationAligner::choose_points(std::size_t index) {
  const Level& level = levels_[index];
  const SmallImage& image = a_[index];
  const int width = image.grey.width_px;
  const int height = image.grey.height_px;
  const bool wraps = level.camera.wrap_width_px() > 0.0;
  points_ = {};
  for (int y = 1; y + 1 < height; ++y) {
    for (int x = wraps ? 0 : 1; x + (wraps ? 0 : 1) < width; ++x) {
      const auto k = static_cast<std::size_t>(y * width + x);
      const bool is_masked = !image.mask.values.empty() && image.mask.values[k] == 0;
      if (level.weights[k] == 0.0f || is_masked) continue;
      const std::uint8_t* const row = image.grey.row(y);
      const Eigen::Vector2d slope(0.5 * (row[(x + 1) % width] - row[(x + width - 1) % width]),
                                  0.5 * (image.grey.row(y + 1)[x] - image.grey.row(y - 1)[x]));
      points_.pixels.push_back(k);
      points_.bearings.push_back(level.bearings[k]);
      points_.gradients.push_back(
          gradient_by_turn(level.bearings[k], level.pixel_from_bearing[k], slope));
      points_.greys.push_back(row[x]);
      points_.weights.push_back(level.weights[k]);
    }
  }
  const std::size_t count = points_.pixels.size();
  turned_.resize(count), pixels_.resize(count), is_seen_.resize(count), seen_greys_.resize(count);
}

void RotationAligner::look(std::size_t index, const Eigen::Quaterniond& b_from_a) {
  const Level& level = levels_[index];
  const SmallImage& image = b_[index];
  const Eigen::Matrix3d turn = b_from_a.toRotationMatrix();
  for (std::size_t i = 0; i < turned_.size(); ++i) turned_[i] = turn * points_.bearings[i];
  level.camera.project(turned_, pixels_, is_seen_);
  const bool wraps = level.camera.wrap_width_px() > 0.0;
  for (std::size_t i = 0; i < turned_.size(); ++i) {
    if (!is_seen_[i]) continue;
    if (!image.mask.values.empty()) {
      const auto at = static_cast<std::size_t>(index_of(pixels_[i], image.mask.width_px));
      is_seen_[i] = image.mask.values[at] != 0;
    }
    if (is_seen_[i]) seen_greys_[i] = sample(image.grey, pixels_[i], wraps);
  }
}

void RotationAligner::look(const Trial& trial) {
  const SmallImage& image = b_[kCoarsest - 1];
  const bool has_mask = !image.mask.values.empty();
  for (std::size_t i = 0; i < points_.pixels.size(); ++i) {
    const int pixel = trial.pixels[points_.pixels[i]];
    const auto at = static_cast<std::size_t>(std::max(pixel, 0));
    is_seen_[i] = pixel >= 0 && (!has_mask || image.mask.values[at] != 0);
    seen_greys_[i] = image.grey.values[at];
  }
}

RotationAligner::Candidate RotationAligner::compare(const Eigen::Quaterniond& b_from_a) const {
  Correlation pairs;
  double all = 0.0;
  for (std::size_t i = 0; i < seen_greys_.size(); ++i) {
    const double weight = points_.weights[i];
    all += weight;
    if (is_seen_[i]) pairs.add(points_.greys[i], seen_greys_[i], weight);
  }
  Candidate candidate{{b_from_a}};
  const double n = pairs.n;
  if (n < kMinOverlap * all || n < kMinPixels) return candidate;
  const double scatter_a = pairs.scatter_a();
  const double scatter_b = pairs.scatter_b();
  if (scatter_a <= n || scatter_b <= n) return candidate;  // Nothing to see.
  RotationAlignment& alignment = candidate.alignment;
  alignment.gain = std::sqrt(scatter_b / scatter_a);
  alignment.offset = (pairs.b - alignment.gain * pairs.a) / n;
  alignment.correlation = pairs.coefficient();
  candidate.certainty = std::atanh(std::min(alignment.correlation, 0.9999)) * std::sqrt(n - 3.0);
  return candidate;
}

std::vector<RotationAlignment> RotationAligner::search() {
  choose_points(kCoarsest);
  std::vector<Candidate> tried;
  for (const Trial& trial : trials_) {
    look(trial);
    tried.push_back(compare(trial.turn));
  }
  std::ranges::stable_sort(tried, std::greater{}, &Candidate::certainty);
  const double neighbour_rad = 1.6 * central_pixel_angle(levels_[kCoarsest].camera);
  std::vector<RotationAlignment> best;
  for (const Candidate& candidate : tried) {
    const RotationAlignment& alignment = candidate.alignment;
    const bool is_near = std::ranges::any_of(best, [&](const RotationAlignment& better) {
      return better.b_from_a.angularDistance(alignment.b_from_a) < neighbour_rad;
    });
    if (!is_near) best.push_back(alignment);
    if (best.size() == kNumRefined) break;
  }
  return best;
}

double RotationAligner::step(RotationAlignment& alignment) {
  errors_.clear();
  const auto gain = static_cast<float>(alignment.gain);
  const auto offset = static_cast<float>(alignment.offset);
  const auto error = [&](std::size_t i) {
    return seen_greys_[i] - gain * points_.greys[i] - offset;
  };
  for (std::size_t i = 0; i < seen_greys_.size(); ++i) {
    if (is_seen_[i]) errors_.push_back(std::abs(error(i)));
  }
  if (errors_.empty()) return 0.0;
  const float limit = kHuberSigmas95 * kSigmaOfMedian * std::max(1.0f, median(errors_));
  using Vector5d = Eigen::Vector<double, 5>;
  Eigen::Matrix<double, 5, 5> hessian = 1e-9 * Eigen::Matrix<double, 5, 5>::Identity();
  Vector5d gradient = Vector5d::Zero();
  for (std::size_t i = 0; i < seen_greys_.size(); ++i) {
    if (!is_seen_[i]) continue;
    Vector5d jacobian;
    jacobian << alignment.gain * points_.gradients[i], points_.greys[i], 1.0;
    const float e = error(i);
    const double weight = points_.weights[i] * huber_weight(e, limit);
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(jacobian, weight);
    gradient += weight * e * jacobian;
  }
  const Vector5d change = hessian.selfadjointView<Eigen::Lower>().ldlt().solve(gradient);
  if (!change.allFinite()) return 0.0;
  alignment.b_from_a = (alignment.b_from_a * so3_exp(-change.head<3>())).normalized();
  alignment.gain += change[3];
  alignment.offset += change[4];
  return change.head<3>().norm();
}

RotationAlignment RotationAligner::refine(std::size_t level, RotationAlignment alignment) {
  choose_points(level);
  const double small_rad = 0.05 * central_pixel_angle(levels_[level].camera);
  for (int i = 0; i < kMaxSteps; ++i) {
    look(level, alignment.b_from_a);
    if (step(alignment) < small_rad) break;
  }
  look(level, alignment.b_from_a);
  return compare(alignment.b_from_a).alignment;
}

RotationAlignment RotationAligner::align(const std::shared_ptr<const Camera>& camera,
                                         const SmallImage& a,
                                         const SmallImage& b) {
  RotationAlignment best;
  // A strip has no coarse levels.
  if (std::min(a.grey.width_px, a.grey.height_px) < 1 << kCoarsest) return best;
  set_camera(camera);
  set_images(a, b);
  for (const RotationAlignment& start : search()) {
    const RotationAlignment refined = refine(kCoarsest - 1, start);
    if (refined.correlation > best.correlation) best = refined;
  }
  return refine(0, best);
}

}  // namespace waymark
