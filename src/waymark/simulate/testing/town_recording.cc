// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/testing/town_recording.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/features/pyramid.h"

namespace waymark {

/// A point in the image of camera 0.
struct TownRecording::Seen {
  std::uint32_t id = 0;
  Town::Point point;
  Eigen::Vector2d error_px = Eigen::Vector2d::Zero();  ///< Of the pixel, in those of its level.
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  int level = 0;
  double angle_rad = 0.0;
  double range_m = 0.0;
};

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Fronts more slanted than this show no corners.
constexpr double kMinCosOfFront = 0.1;
/// Streams of random numbers; frames have those from kFirstFrameStream on.
enum RecordingStream : std::uint64_t { kWayStream, kFirstFrameStream };

/// Bits that are set with a probability, which has eight digits.
std::uint64_t biased_bits(double probability, Rng& rng) {
  constexpr int kNumDigits = 8;
  const auto digits = static_cast<unsigned>(std::lround(std::ldexp(probability, kNumDigits)));
  if (digits >> kNumDigits) return ~std::uint64_t{0};
  std::uint64_t bits = 0;
  for (int i = 0; i < kNumDigits && digits > 0; ++i) {
    const std::uint64_t other = rng.next();
    bits = digits >> i & 1 ? bits | other : bits & other;
  }
  return bits;
}

void flip_some_bits(double probability, Rng& rng, Descriptor& descriptor) {
  for (std::uint64_t& word : descriptor) word ^= biased_bits(probability, rng);
}

/// Whether all along the border of its image a camera looks ahead.
bool has_no_back(const Camera& camera) {
  std::vector<Vector2d> pixels;
  constexpr int kNumSteps = 8;
  for (int i = 0; i <= kNumSteps; ++i) {
    const double x = (camera.width_px() - 1.0) * i / kNumSteps;
    const double y = (camera.height_px() - 1.0) * i / kNumSteps;
    for (const double end : {0.0, camera.width_px() - 1.0}) pixels.emplace_back(end, y);
    for (const double end : {0.0, camera.height_px() - 1.0}) pixels.emplace_back(x, end);
  }
  std::vector<Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!is_valid[i] || bearings[i].z() <= 0.0) return false;
  }
  return true;
}

/// Where a curve (Bezier, of second degree) is, and its direction.
std::pair<Vector2d, Vector2d> on_curve(const Vector2d& from,
                                       const Vector2d& over,
                                       const Vector2d& to,
                                       double part) {
  const Vector2d a = (1.0 - part) * from + part * over;
  const Vector2d b = (1.0 - part) * over + part * to;
  return {(1.0 - part) * a + part * b, (b - a).normalized()};
}

Keypoint make_keypoint(const Vector2d& pixel, int level, double angle_rad, std::uint8_t camera) {
  Keypoint keypoint;
  keypoint.x_px = static_cast<float>(pixel.x());
  keypoint.y_px = static_cast<float>(pixel.y());
  keypoint.angle_rad = static_cast<float>(angle_rad);
  keypoint.level = static_cast<std::uint8_t>(level);
  keypoint.camera = camera;
  return keypoint;
}

}  // namespace

TownRecording::TownRecording(std::shared_ptr<const Town> town,
                             std::shared_ptr<const Rig> rig,
                             const TownRecordingSettings& settings)
    : town_(std::move(town)),
      rig_(std::move(rig)),
      settings_(settings),
      looks_ahead_only_(has_no_back(*rig_->cameras.at(0).camera)) {
  WAYMARK_CHECK(rig_->cameras.size() <= 2 && settings.step_m > 0.0);
  choose_way();
}

void TownRecording::choose_way() {
  Rng rng(settings_.seed, kWayStream);
  std::uint32_t street = rng.below(static_cast<std::uint32_t>(town_->streets().size()));
  bool is_forward = rng.below(2) == 1;
  const double length_m = settings_.step_m * settings_.num_frames;
  while (legs_.empty() || legs_.back().begin_m + legs_.back().length_m <= length_m) {
    const Town::Street& here = town_->streets()[street];
    const Vector2d& begin = is_forward ? here.begin : here.end;
    const Vector2d& end = is_forward ? here.end : here.begin;
    way_.push_back(street);
    add_leg(begin, 0.5 * (begin + end), end, {.street = street});
    const std::uint32_t crossing = is_forward ? here.to : here.from;
    std::vector<std::uint32_t> others = town_->streets_at(crossing);
    std::erase(others, street);
    street = others[rng.below(static_cast<std::uint32_t>(others.size()))];
    const Town::Street& next = town_->streets()[street];
    is_forward = next.from == crossing;
    const Vector2d& on = is_forward ? next.begin : next.end;
    add_leg(end, town_->crossings()[crossing], on, {.crossing = crossing});
  }
}

void TownRecording::add_leg(const Vector2d& from,
                            const Vector2d& over,
                            const Vector2d& to,
                            const TownPlace& place) {
  Leg leg{.from = from, .over = over, .to = to, .place = place};
  if (!legs_.empty()) leg.begin_m = legs_.back().begin_m + legs_.back().length_m;
  constexpr int kNumChords = 16;
  Vector2d last = from;
  for (int i = 1; i <= kNumChords; ++i) {
    const Vector2d at = on_curve(from, over, to, static_cast<double>(i) / kNumChords).first;
    leg.length_m += (at - last).norm();
    last = at;
  }
  legs_.push_back(leg);
}

TownRecording::Stand TownRecording::stand_at(std::uint32_t frame) const {
  WAYMARK_CHECK(frame < settings_.num_frames);
  const double at_m = settings_.step_m * frame;
  const auto after = std::ranges::upper_bound(legs_, at_m, {}, &Leg::begin_m);
  const Leg& leg = *std::prev(after);
  const double part = std::min(1.0, (at_m - leg.begin_m) / leg.length_m);
  const auto [at, direction] = on_curve(leg.from, leg.over, leg.to, part);
  const double yaw = std::atan2(direction.x(), direction.y());
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Vector3d::UnitY()));
  return {{turn, {at.x(), 0.0, at.y()}}, leg.place};
}

/// What camera 0 sees, with noise.
std::vector<TownRecording::Seen> TownRecording::see(const Stand& stand, Rng& rng) const {
  const Vector3d eye = stand.world_from_rig.translation;
  const Vector3d ahead = stand.world_from_rig.rotation * Vector3d::UnitZ();
  std::vector<std::uint32_t> ids;
  town_->list_in_sight(stand.place,
                       {eye.x(), eye.z()},
                       looks_ahead_only_ ? Vector2d(ahead.x(), ahead.z()) : Vector2d::Zero().eval(),
                       settings_.max_distance_m,
                       ids);
  const Camera& camera = *rig_->cameras[0].camera;
  const Rigid3 cam_from_world = rig_->cameras[0].cam_from_rig * stand.world_from_rig.inverse();
  std::vector<Seen> seen;
  std::vector<Vector3d> points;
  for (const std::uint32_t id : ids) {
    if (rng.uniform() < settings_.miss_probability) continue;
    if (Rng(settings_.seed, ~std::uint64_t{id}).uniform() < settings_.light_dropout) continue;
    Seen one{.id = id, .point = town_->point(id)};
    const Vector3d ray = one.point.position - eye;
    one.range_m = ray.norm();
    if (-ray.dot(one.point.normal) < kMinCosOfFront * one.range_m) continue;
    points.push_back(cam_from_world * one.point.position);
    seen.push_back(one);
  }
  std::vector<Vector2d> pixels(points.size(), Vector2d::Zero());
  std::vector<Matrix23d> jacobians(points.size(), Matrix23d::Zero());
  std::vector<std::uint8_t> is_visible(points.size());
  camera.project_with_jacobian(points, pixels, jacobians, is_visible);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!is_visible[i]) continue;
    Seen& one = seen[i];
    // Pixels per metre at the point, in the mean of all directions.
    const double density = std::pow((jacobians[i] * jacobians[i].transpose()).determinant(), 0.25);
    const double scale = one.point.look->size_m * density;
    one.level = static_cast<int>(std::lround(std::log(scale) / std::log(Pyramid::kScaleFactor)));
    if (one.level < 0 || one.level >= Pyramid::kNumLevels) continue;
    const double error_x = settings_.pixel_sigma * rng.normal();
    one.error_px = {error_x, settings_.pixel_sigma * rng.normal()};
    one.pixel = pixels[i] + Pyramid::scale(one.level) * one.error_px;
    if (!camera.contains(one.pixel)) continue;
    const Vector2d along = jacobians[i] * (cam_from_world.rotation * one.point.tangent);
    one.angle_rad = std::atan2(along.y(), along.x());
    seen[kept++] = one;
  }
  seen.resize(kept);
  return seen;
}

Descriptor TownRecording::look(const Seen& seen, const Vector3d& eye, Rng& rng) const {
  Descriptor look = town_->look_from(seen.point, eye);
  // What the light changes is the same in all frames of the recording.
  Rng of_light(~settings_.seed, seen.id);
  flip_some_bits(settings_.light_flips, of_light, look);
  flip_some_bits(settings_.flip_probability, rng, look);
  return look;
}

/// Features of camera 1 are found again where those of camera 0 are: with their errors, and half as
/// much of their own.
void TownRecording::add_second_camera(const Stand& stand,
                                      const std::vector<Seen>& seen,
                                      Rng& rng,
                                      TownFrame& frame,
                                      Features& features) const {
  const Camera& camera = *rig_->cameras[1].camera;
  const Rigid3 cam_from_world = rig_->cameras[1].cam_from_rig * stand.world_from_rig.inverse();
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    const Vector3d point = cam_from_world * seen[i].point.position;
    Vector2d pixel;
    Vector3d bearing;
    std::uint8_t is_visible = 0;
    std::uint8_t is_valid = 0;
    camera.project({&point, 1}, {&pixel, 1}, {&is_visible, 1});
    const double error_x = 0.5 * settings_.pixel_sigma * rng.normal();
    const Vector2d own_error(error_x, 0.5 * settings_.pixel_sigma * rng.normal());
    pixel += Pyramid::scale(seen[i].level) * (seen[i].error_px + own_error);
    if (!is_visible || !camera.contains(pixel)) continue;
    camera.unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
    if (!is_valid) continue;
    features.partner[i] = static_cast<std::uint32_t>(features.keypoints.size());
    features.partner.push_back(i);
    features.keypoints.push_back(make_keypoint(pixel, seen[i].level, seen[i].angle_rad, 1));
    frame.point_of_feature.push_back(seen[i].id);
  }
}

/// Of what is in sight the strongest, in the order of an extractor: by level, row and column.
void TownRecording::choose(std::vector<Seen>& seen) const {
  if (seen.size() > settings_.max_features) {
    const auto is_stronger = [](const Seen& a, const Seen& b) {
      return std::tuple(-a.point.look->response, a.id) < std::tuple(-b.point.look->response, b.id);
    };
    std::nth_element(seen.begin(), seen.begin() + settings_.max_features, seen.end(), is_stronger);
    seen.resize(settings_.max_features);
  }
  std::vector<Vector2d> pixels;
  for (const Seen& one : seen) pixels.push_back(one.pixel);
  std::vector<Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  rig_->cameras[0].camera->unproject(pixels, bearings, is_valid);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (is_valid[i]) seen[kept++] = seen[i];
  }
  seen.resize(kept);
  std::ranges::sort(seen, {}, [](const Seen& one) {
    return std::tuple(one.level, one.pixel.y(), one.pixel.x(), one.id);
  });
}

TownFrame TownRecording::frame(std::uint32_t index) const {
  Rng rng(settings_.seed, kFirstFrameStream + index);
  const Stand stand = stand_at(index);
  std::vector<Seen> seen = see(stand, rng);
  choose(seen);
  TownFrame frame;
  frame.world_from_rig = stand.world_from_rig;
  auto features = std::make_shared<Features>();
  features->rig = rig_;
  features->num_primary = seen.size();
  features->partner.assign(seen.size(), kNoFeature);
  features->range_m.assign(seen.size(), 0.0f);
  features->inverse_range_sigma.assign(seen.size(), 0.0f);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    features->keypoints.push_back(
        make_keypoint(seen[i].pixel, seen[i].level, seen[i].angle_rad, 0));
    features->keypoints.back().response = 100.0f * seen[i].point.look->response;
    features->descriptors.push_back(look(seen[i], stand.world_from_rig.translation, rng));
    frame.point_of_feature.push_back(seen[i].id);
    const double inverse = 1.0 / seen[i].range_m + settings_.inverse_range_sigma * rng.normal();
    if (settings_.inverse_range_sigma <= 0.0 || inverse <= 0.0) continue;
    features->range_m[i] = static_cast<float>(1.0 / inverse);
    features->inverse_range_sigma[i] = static_cast<float>(settings_.inverse_range_sigma);
  }
  if (rig_->cameras.size() > 1) add_second_camera(stand, seen, rng, frame, *features);
  derive_geometry(*rig_, *features);
  if (rig_->cameras.size() > 1) measure_stereo_ranges(*rig_, *features);
  frame.features = std::move(features);
  return frame;
}

}  // namespace waymark
