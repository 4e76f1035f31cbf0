// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/picture_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/camera/scaled_camera.h"
#include "waymark/image/pyramid.h"
#include "waymark/optimize/residual.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kMaxPictures = 100;
constexpr std::size_t kMinPictures = 10;
constexpr std::size_t kMinSights = 40;
/// Landmarks with fewer keyframes follow any shift.
constexpr std::size_t kMinObservers = 3;
/// Of poses and shifts with the landmarks held, and of these with the pictures held, in turn.
constexpr int kNumSweeps = 15;
constexpr double kHuberPx = 1.0;
/// A shift is an estimate where its standard deviation is below this part of the width.
constexpr double kMaxSigma = 0.01;
/// Median absolute deviations of normally distributed values, per standard deviation.
constexpr double kMadPerSigma = 0.6745;
/// Of recordings without stabilisation at most 0.04 is explained, with a calibration that stays
/// wrong 0.1 (docs/decisions.md).
constexpr double kLeastExplained = 0.12;
/// Part of the width.
constexpr double kLeastScatter = 0.004;

/// What a feature of a picture measures of a point.
struct Sight {
  std::uint32_t picture = 0;
  std::uint32_t point = 0;
  Eigen::Vector3f bearing;
  Matrix23f level_pixel_from_bearing;
  double per_level_pixel = 1.0;  ///< Pixels of the level in one of level 0.
  /// By what a wrong focal length and a wrong distortion move the pixel, per unit.
  Eigen::Matrix2d pixel_by_lens;
};

/// The image of camera 0 of a keyframe.
struct Picture {
  Rigid3 cam_from_world;
  Vector2d shift_px = Vector2d::Zero();  ///< Of what is seen, in the image.
  std::vector<std::uint32_t> sights;
  bool is_shift_known = false;
};

/// A focal length that is longer by a part, and an image that is bent by a part in its corners.
Eigen::Matrix2d pixel_by_lens(const Camera& camera, const Keypoint& keypoint) {
  const Vector2d outwards = Vector2d(keypoint.x_px, keypoint.y_px) - principal_point(camera);
  const double half_diagonal_px = 0.5 * std::hypot(camera.width_px(), camera.height_px());
  Eigen::Matrix2d by;
  by << outwards, outwards * (outwards.squaredNorm() / (half_diagonal_px * half_diagonal_px));
  return by;
}

/// Pictures and points that are adjusted in turn.
class MovingPictures {
 public:
  MovingPictures(const Map& map, const std::vector<KeyframeId>& keyframes, double max_sigma_px);

  std::size_t num_pictures() const { return pictures_.size(); }
  /// The cost that is left.
  double adjust(bool may_shift);
  /// Of the pictures whose shift is known.
  std::vector<double> shifts(int axis) const;

 private:
  /// A residual in pixels of the level, and its derivative by the point in the camera.
  struct Term {
    Vector2d residual;
    Matrix23d by_point;
    Vector3d point_in_cam;
  };

  bool linearize(const Sight& sight, Term& term) const;
  template <int kNumUnknowns>
  void move_picture(Picture& picture);
  void move_point(std::uint32_t point);
  void change_lens();
  double cost(const std::vector<std::uint32_t>& sights) const;

  double max_sigma_px_;
  Vector2d lens_ = Vector2d::Zero();  ///< What all pictures have in common, see pixel_by_lens.
  std::vector<Picture> pictures_;
  std::vector<Vector3d> points_;
  std::vector<Sight> sights_;
  std::vector<std::vector<std::uint32_t>> sights_of_point_;
};

MovingPictures::MovingPictures(const Map& map,
                               const std::vector<KeyframeId>& keyframes,
                               double max_sigma_px)
    : max_sigma_px_(max_sigma_px) {
  std::vector<std::pair<LandmarkId, std::uint32_t>> seen;  // By sight.
  for (KeyframeId id : keyframes) {
    const Keyframe& keyframe = map.keyframes().at(id);
    const Features& features = *keyframe.features;
    Picture picture;
    picture.cam_from_world = keyframe.rig->cameras[0].cam_from_rig * keyframe.rig_from_world;
    for (std::uint32_t i = 0; i < features.num_corners(); ++i) {
      const LandmarkId landmark = keyframe.landmarks[i];
      if (!landmark.is_valid()) continue;
      if (num_observers(map.landmarks().at(landmark)) < kMinObservers) continue;
      const auto at = static_cast<std::uint32_t>(sights_.size());
      picture.sights.push_back(at);
      seen.emplace_back(landmark, at);
      sights_.push_back({static_cast<std::uint32_t>(pictures_.size()),
                         0,
                         features.bearings[i],
                         features.level_pixel_from_bearing[i],
                         1.0 / Pyramid::scale(features.keypoints[i].level),
                         pixel_by_lens(*keyframe.rig->cameras[0].camera, features.keypoints[i])});
    }
    pictures_.push_back(std::move(picture));
  }
  std::ranges::sort(seen);
  LandmarkId last;
  for (const auto& [landmark, sight] : seen) {
    if (landmark != last) {
      points_.push_back(map.landmarks().at(landmark).position_in_world);
      sights_of_point_.emplace_back();
      last = landmark;
    }
    sights_[sight].point = static_cast<std::uint32_t>(points_.size() - 1);
    sights_of_point_.back().push_back(sight);
  }
}

bool MovingPictures::linearize(const Sight& sight, Term& term) const {
  const Picture& picture = pictures_[sight.picture];
  term.point_in_cam = picture.cam_from_world * points_[sight.point];
  const InverseRangePoint point = in_inverse_range(term.point_in_cam);
  if (!is_ahead(point, sight.bearing)) return false;
  const Matrix23f& w = sight.level_pixel_from_bearing;
  const Vector2d moved_px = picture.shift_px + sight.pixel_by_lens * lens_;
  term.residual = bearing_residual(point, sight.bearing, w) + sight.per_level_pixel * moved_px;
  term.by_point = bearing_residual_by_point(point, w);
  return true;
}

/// One step of the pose, and with 8 unknowns of the shift.
template <int kNumUnknowns>
void MovingPictures::move_picture(Picture& picture) {
  using Vector = Eigen::Matrix<double, kNumUnknowns, 1>;
  using Matrix = Eigen::Matrix<double, kNumUnknowns, kNumUnknowns>;
  Matrix information = Matrix::Zero();
  Vector pull = Vector::Zero();
  double squares = 0.0;
  int freedom = -kNumUnknowns;
  Term term;
  for (std::uint32_t at : picture.sights) {
    if (!linearize(sights_[at], term)) continue;
    Eigen::Matrix<double, 2, kNumUnknowns> by;
    by.template leftCols<3>() = term.by_point;
    by.template middleCols<3>(3) = -term.by_point * skew(term.point_in_cam);
    if constexpr (kNumUnknowns == 8) {
      by.template rightCols<2>() = sights_[at].per_level_pixel * Eigen::Matrix2d::Identity();
    }
    const double squared = term.residual.squaredNorm();
    const double weight = huber(squared, kHuberPx).weight;
    information += weight * by.transpose() * by;
    pull += weight * by.transpose() * term.residual;
    squares += weight * squared;
    freedom += 2;
  }
  picture.is_shift_known = false;
  if (picture.sights.size() < kMinSights || freedom <= 0) return;
  const Eigen::LDLT<Matrix> equations(information);
  const Vector step = -equations.solve(pull);
  if (!step.allFinite()) return;
  picture.cam_from_world = Rigid3::exp(step.template head<6>()) * picture.cam_from_world;
  if constexpr (kNumUnknowns == 8) {
    picture.shift_px += step.template tail<2>();
    const Matrix covariance = squares / freedom * equations.solve(Matrix::Identity());
    const double variance = covariance.diagonal().template tail<2>().maxCoeff();
    picture.is_shift_known = variance < max_sigma_px_ * max_sigma_px_;
  }
}

void MovingPictures::move_point(std::uint32_t point) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Vector3d pull = Vector3d::Zero();
  Term term;
  for (std::uint32_t at : sights_of_point_[point]) {
    if (!linearize(sights_[at], term)) continue;
    const Matrix23d by =
        term.by_point * pictures_[sights_[at].picture].cam_from_world.rotation_matrix();
    const double weight = huber(term.residual.squaredNorm(), kHuberPx).weight;
    information += weight * by.transpose() * by;
    pull += weight * by.transpose() * term.residual;
  }
  // A point far away, or seen from about one place, hardly moves along its rays.
  constexpr double kDamping = 1e-6;
  information.diagonal().array() += kDamping * information.trace();
  const Vector3d before = points_[point];
  const double cost_before = cost(sights_of_point_[point]);
  points_[point] -= information.ldlt().solve(pull);
  if (!(cost(sights_of_point_[point]) < cost_before)) points_[point] = before;
}

/// One step of what a wrong calibration does to all pictures alike.
void MovingPictures::change_lens() {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Vector2d pull = Vector2d::Zero();
  Term term;
  for (const Sight& sight : sights_) {
    if (!linearize(sight, term)) continue;
    const Eigen::Matrix2d by = sight.per_level_pixel * sight.pixel_by_lens;
    const double weight = huber(term.residual.squaredNorm(), kHuberPx).weight;
    information += weight * by.transpose() * by;
    pull += weight * by.transpose() * term.residual;
  }
  const Vector2d step = -information.ldlt().solve(pull);
  if (step.allFinite()) lens_ += step;
}

double MovingPictures::cost(const std::vector<std::uint32_t>& sights) const {
  double sum = 0.0;
  Term term;
  for (std::uint32_t at : sights) {
    const bool is_seen = linearize(sights_[at], term);
    const double squared = is_seen ? term.residual.squaredNorm() : kGrossSquaredResidual;
    sum += huber(squared, kHuberPx).loss;
  }
  return sum;
}

double MovingPictures::adjust(bool may_shift) {
  for (int sweep = 0; sweep < kNumSweeps; ++sweep) {
    for (Picture& picture : pictures_) {
      may_shift ? move_picture<8>(picture) : move_picture<6>(picture);
    }
    change_lens();
    for (std::uint32_t point = 0; point < points_.size(); ++point) move_point(point);
  }
  double sum = 0.0;
  for (const Picture& picture : pictures_) sum += cost(picture.sights);
  return sum;
}

std::vector<double> MovingPictures::shifts(int axis) const {
  std::vector<double> shifts;
  for (const Picture& picture : pictures_) {
    if (picture.is_shift_known) shifts.push_back(picture.shift_px[axis]);
  }
  return shifts;
}

double scatter_of(std::vector<double> values) {
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  return median(values) / kMadPerSigma;
}

/// The newest ones of the newest rig, ascending.
std::vector<KeyframeId> newest_keyframes(const Map& map) {
  std::vector<KeyframeId> keyframes;
  const Rig* rig = nullptr;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (std::exchange(rig, keyframe.rig.get()) != keyframe.rig.get()) keyframes.clear();
    keyframes.push_back(id);
  });
  if (keyframes.size() > kMaxPictures) {
    keyframes.erase(keyframes.begin(), keyframes.end() - kMaxPictures);
  }
  return keyframes;
}

}  // namespace

bool PictureMotion::is_stabilised() const {
  return explained > kLeastExplained && scatter_px > kLeastScatter * width_px;
}

std::optional<PictureMotion> find_picture_motion(const Map& map) {
  const std::vector<KeyframeId> keyframes = newest_keyframes(map);
  if (keyframes.size() < kMinPictures) return std::nullopt;
  const Camera& camera = *map.keyframes().at(keyframes.back()).rig->cameras[0].camera;
  if (camera.wrap_width_px() > 0.0) return std::nullopt;
  PictureMotion motion{.width_px = camera.width_px()};
  const MovingPictures scene(map, keyframes, kMaxSigma * motion.width_px);
  MovingPictures still = scene;
  MovingPictures shifted = scene;
  const double cost = still.adjust(false);
  motion.explained = cost > 0.0 ? 1.0 - shifted.adjust(true) / cost : 0.0;
  if (shifted.shifts(0).size() < kMinPictures) return std::nullopt;
  motion.scatter_px = std::max(scatter_of(shifted.shifts(0)), scatter_of(shifted.shifts(1)));
  return motion;
}

}  // namespace waymark
