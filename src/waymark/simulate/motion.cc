// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/motion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr int kNumWaves = 4;

void add_scaled(const MotionKey& key, double weight, MotionKey& sum) {
  sum.position += weight * key.position;
  sum.yaw_deg += weight * key.yaw_deg;
  sum.pitch_deg += weight * key.pitch_deg;
  sum.roll_deg += weight * key.roll_deg;
}

Vector3d random_signs(Rng& rng, double amplitude) {
  const double x = rng.uniform(-amplitude, amplitude);
  const double y = rng.uniform(-amplitude, amplitude);
  return {x, y, rng.uniform(-amplitude, amplitude)};
}

/// Where one can go in a world. Paths run along the closed polygon; keys are spacing apart, and the
/// spline rounds the corners by about as much.
struct Course {
  std::string_view world;
  std::vector<Vector2d> path;
  double spacing_m;
  double height_m;
  double look_around_deg;
  CameraShake sway;
  MotionKey start;  ///< With 1 m of free space around and 2 m ahead.
};

/// Around one of two rooms that look alike, along the corridor, around the other in the same way,
/// and back. It begins in the middle of the first round, so that at the end there are places of the
/// first room that were seen in the other one only.
std::vector<Vector2d> rounds_of_both_rooms() {
  constexpr double kDoor = 2.25;
  constexpr double kApart = 5.2;
  const Vector2d in_door(kDoor, 0.8);
  const Vector2d in_corridor(kDoor, -1.3);
  std::vector<Vector2d> path = {{1.3, 2.8}, {3.2, 2.8}, {3.2, 1.3}, in_door, in_corridor};
  const std::vector<Vector2d> round = {
      in_corridor, in_door, {1.3, 1.3}, {1.3, 2.8}, {3.2, 2.8}, {3.2, 1.3}, in_door, in_corridor};
  for (const Vector2d& point : round) path.emplace_back(point.x() + kApart, point.y());
  path.insert(path.end(), round.begin(), round.begin() + 3);
  return path;
}

std::vector<Course> courses() {
  const CameraShake hand{0.02, 1.2, 11};
  const CameraShake wheels{0.01, 0.25, 12};
  const std::vector<Vector2d> around_table = {{1.3, 1.2}, {4.7, 1.2}, {4.7, 3.8}, {1.3, 3.8}};
  const std::vector<Vector2d> ring = {{2.0, 1.75}, {6.2, 1.75}, {6.2, 5.45}, {2.0, 5.45}};
  const std::vector<Vector2d> aisle = {{4.0, 4.2}, {20.0, 4.2}, {20.0, 11.8}, {4.0, 11.8}};
  const std::vector<Vector2d> road = {{0.0, 0.0}, {40.0, 0.0}, {40.0, 28.0}, {0.0, 28.0}};
  const std::vector<Vector2d> both_rooms = rounds_of_both_rooms();
  const std::vector<Vector2d> there_and_back = {{1.0, 0.7}, {49.0, 0.7}, {49.0, 1.6}, {1.0, 1.6}};
  const std::vector<Vector2d> aisles = {{1.5, 1.5},
                                        {22.5, 1.5},
                                        {22.5, 4.5},
                                        {1.5, 4.5},
                                        {1.5, 7.5},
                                        {22.5, 7.5},
                                        {22.5, 10.5},
                                        {1.5, 10.5}};
  return {{"room", around_table, 0.8, 1.5, 22.0, hand, {{1.5, 1.3, 1.5}, 35.0, -6.0, 0.0}},
          {"bare", around_table, 0.8, 1.5, 22.0, hand, {{1.5, 1.3, 1.5}, 35.0, -6.0, 0.0}},
          {"apartment", ring, 0.75, 1.5, 18.0, hand, {{1.5, 1.75, 1.5}, 0.0, -4.0, 0.0}},
          {"blank", ring, 0.75, 1.5, 18.0, hand, {{1.5, 1.75, 1.5}, 0.0, -4.0, 0.0}},
          {"hall", aisle, 2.0, 1.6, 20.0, hand, {{4.5, 4.5, 1.6}, 20.0, 2.0, 0.0}},
          {"corridor", there_and_back, 0.6, 1.5, 12.0, hand, {{1.2, 1.1, 1.5}, 0.0, -4.0, 0.0}},
          {"shop", aisles, 1.0, 1.5, 15.0, hand, {{1.5, 1.5, 1.5}, 0.0, -2.0, 0.0}},
          {"street", road, 8.0, 1.6, 0.0, wheels, {{10.0, 0.0, 1.6}, 0.0, 0.0, 0.0}},
          {"twins", both_rooms, 0.7, 1.5, 15.0, hand, {{2.25, 1.5, 1.5}, 90.0, -4.0, 0.0}}};
}

double path_length(const Course& course) {
  double length = 0.0;
  const std::size_t count = course.path.size();
  for (std::size_t i = 0; i < count; ++i) {
    length += (course.path[(i + 1) % count] - course.path[i]).norm();
  }
  return length;
}

/// The point at arc length s.
Vector2d path_point(const Course& course, double s) {
  const std::size_t count = course.path.size();
  const double length = path_length(course);
  s -= length * std::floor(s / length);
  for (std::size_t i = 0;; ++i) {
    const Vector2d& from = course.path[i];
    const Vector2d side = course.path[(i + 1) % count] - from;
    if (s <= side.norm() || i == count - 1) return from + s / side.norm() * side;
    s -= side.norm();
  }
}

/// Where all walks begin, as arc length.
double path_start(const Course& course) { return 0.4 * (course.path[1] - course.path[0]).norm(); }

/// A key at arc length s. heading_deg is that of the key before, from which the new one goes on.
MotionKey path_key(const Course& course,
                   double s,
                   double head_deg,
                   double pitch_deg,
                   std::optional<double>& heading_deg) {
  const Vector2d ahead = path_point(course, s + course.spacing_m);
  const Vector2d tangent = ahead - path_point(course, s - course.spacing_m);
  const double angle = kDegPerRad * std::atan2(tangent.y(), tangent.x());
  const double before = heading_deg.value_or(angle);
  heading_deg = before + std::remainder(angle - before, 360.0);
  const Vector2d point = path_point(course, s);
  return {{point.x(), point.y(), course.height_m}, *heading_deg + head_deg, pitch_deg, 0.0};
}

double pitch_deg(const Course& course, int i) {
  return course.look_around_deg * 0.25 * std::sin(0.9 * i);
}

/// Keys so many times around the path and a bit on. head_deg(i) turns the head at key i.
template <class HeadTurn>
std::vector<MotionKey> along_path(const Course& course, int num_rounds, HeadTurn head_deg) {
  const double length = path_length(course);
  const double start = path_start(course);
  const double end = start + (num_rounds + 0.06) * length + 2.0 * course.spacing_m;
  const int count = std::max(4, static_cast<int>(std::ceil((end - start) / course.spacing_m)) + 1);
  std::vector<MotionKey> keys;
  std::optional<double> heading;
  for (int i = 0; i < count; ++i) {
    const double s = start + (end - start) * i / (count - 1);
    keys.push_back(path_key(course, s, head_deg(i), pitch_deg(course, i), heading));
  }
  return keys;
}

/// Keys that move about the start by offset(phase), phase from 0 to 1 in `count` steps; offsets are
/// to the right, up and ahead, and yaw, pitch, roll.
template <class Offset>
std::vector<MotionKey> about_start(const Course& course, int count, Offset offset) {
  const Rigid3 start = pose_of(course.start);
  std::vector<MotionKey> keys;
  for (int i = -1; i <= count + 1; ++i) {
    const MotionKey change = offset(static_cast<double>(i) / count);
    MotionKey key = course.start;
    key.position = start * Vector3d(change.position.x(), -change.position.y(), change.position.z());
    key.yaw_deg += change.yaw_deg;
    key.pitch_deg += change.pitch_deg;
    key.roll_deg += change.roll_deg;
    keys.push_back(key);
  }
  return keys;
}

MotionKey slide_offset(double phase) { return {{0.7 * std::sin(kTwoPi * phase), 0.0, 0.0}}; }

MotionKey forward_offset(double phase) {
  return {{0.0, 0.0, 0.8 * (1.0 - std::cos(kTwoPi * phase))}};
}

MotionKey rotate_offset(double phase) {
  return {Vector3d::Zero(),
          100.0 * (1.0 - std::cos(kTwoPi * phase)),
          6.0 * std::sin(3.0 * kTwoPi * phase),
          0.0};
}

MotionKey inspect_offset(double phase) {
  const double a = kTwoPi * phase;
  return {{0.45 * std::sin(2.0 * a), 0.15 * std::sin(3.0 * a), 0.4 * std::sin(a)},
          32.0 * std::sin(a) + 6.0 * std::sin(3.0 * a),
          9.0 * std::sin(2.0 * a),
          5.0 * std::sin(4.0 * a)};
}

std::vector<MotionKey> walk_around(const Course& course, int num_rounds) {
  return along_path(
      course, num_rounds, [&](int i) { return course.look_around_deg * std::sin(0.55 * i); });
}

/// So many rounds of which each has the keys of the first.
std::vector<MotionKey> repeat_round(const Course& course, int num_rounds) {
  const double length = path_length(course);
  const int count = static_cast<int>(std::ceil(length / course.spacing_m));
  std::vector<MotionKey> keys;
  std::optional<double> heading;
  for (int i = 0; i < num_rounds * count + 3; ++i) {
    const int step = i % count;
    const double s = path_start(course) + length * i / count;
    const double head = course.look_around_deg * std::sin(0.55 * step);
    keys.push_back(path_key(course, s, head, pitch_deg(course, step), heading));
  }
  return keys;
}

std::vector<MotionKey> turn_fast(const Course& course) {
  return along_path(course, 1, [](int i) {
    constexpr std::array<double, 8> kTurnDeg = {0.0, 0.0, 0.0, 75.0, 75.0, 0.0, 0.0, -75.0};
    return kTurnDeg[static_cast<std::size_t>(i) % kTurnDeg.size()];
  });
}

/// Yaw of a head that turns between two sides at a constant speed and rests on each.
double turn_deg(double seconds, double deg_per_s) {
  constexpr double kSideDeg = 60.0;
  constexpr double kRest_s = 0.4;
  const double turn_s = 2.0 * kSideDeg / deg_per_s;
  const double first_s = 0.5 * turn_s;  // From the middle to one side.
  if (seconds < first_s) return deg_per_s * seconds;
  const double since_s = seconds - first_s;
  const double turns = std::floor(since_s / (turn_s + kRest_s));
  const double turned_s = std::max(0.0, since_s - turns * (turn_s + kRest_s) - kRest_s);
  const double sign = std::fmod(turns, 2.0) == 0.0 ? 1.0 : -1.0;
  return sign * (kSideDeg - deg_per_s * turned_s);
}

/// Looks to both sides once, slowly, in the first half of the time; then back and forth.
std::vector<MotionKey> look_and_turn(const Course& course,
                                     double duration_s,
                                     double deg_per_s,
                                     double keys_per_s = 10.0) {
  constexpr double kSwingsPerSecond = 0.4;
  const int count = std::max(1, static_cast<int>(keys_per_s * duration_s));
  return about_start(course, count, [&](double phase) {
    const double late_s = (phase - 0.5) * duration_s;
    const double swing = kTwoPi * kSwingsPerSecond * phase * duration_s;
    MotionKey key{{0.4 * std::sin(swing), 0.1 * std::sin(0.7 * swing), 0.2 * std::cos(swing)}};
    key.yaw_deg =
        late_s < 0.0 ? 60.0 * std::sin(2.0 * kTwoPi * phase) : turn_deg(late_s, deg_per_s);
    return key;
  });
}

CameraShake no_sway(const Course&) { return {}; }
CameraShake usual_sway(const Course& course) { return course.sway; }
/// Of what flies or drives: the way itself is exact.
CameraShake hovering(const Course&) { return {0.02, 0.8, 14, 0.3}; }
CameraShake suspension(const Course&) { return {0.0, 0.1, 15, 0.6}; }
/// That of somebody who runs: up to 8 degrees at 1 Hz and less at up to 5 Hz.
CameraShake shaking(const Course&) { return {0.01, 8.0, 13, 1.0}; }

struct NamedMotion {
  std::string_view name;
  std::vector<MotionKey> (*keys)(const Course& course, double duration_s);
  CameraShake (*sway)(const Course& course);
};

constexpr std::array<NamedMotion, 16> kMotions = {{
    {"loop", [](const Course& course, double) { return walk_around(course, 1); }, usual_sway},
    {"rounds", [](const Course& course, double) { return walk_around(course, 3); }, usual_sway},
    {"thirty_rounds",
     [](const Course& course, double) { return repeat_round(course, 30); },
     usual_sway},
    {"fast_turn", [](const Course& course, double) { return turn_fast(course); }, usual_sway},
    {"turns_150",
     [](const Course& course, double duration_s) {
       return look_and_turn(course, duration_s, 150.0);
     },
     usual_sway},
    {"turns_250",
     [](const Course& course, double duration_s) {
       return look_and_turn(course, duration_s, 250.0);
     },
     usual_sway},
    {"turns_400",
     [](const Course& course, double duration_s) {
       return look_and_turn(course, duration_s, 400.0, 20.0);
     },
     usual_sway},
    {"standing_start",
     [](const Course& course, double duration_s) {
       const Motion walk(walk_around(course, 1), duration_s, course.sway);
       return rest_before(walk, 5.0, duration_s);
     },
     no_sway},
    {"drive",
     [](const Course& course, double duration_s) {
       return drive_along(Motion(walk_around(course, 1), duration_s), duration_s);
     },
     suspension},
    {"flight",
     [](const Course& course, double duration_s) {
       return fly_along(Motion(walk_around(course, 1), duration_s), duration_s);
     },
     hovering},
    {"inspect",
     [](const Course& course, double) { return about_start(course, 40, inspect_offset); },
     usual_sway},
    {"shaken",
     [](const Course& course, double) { return about_start(course, 40, inspect_offset); },
     shaking},
    {"slide",
     [](const Course& course, double) { return about_start(course, 40, slide_offset); },
     no_sway},
    {"forward",
     [](const Course& course, double) { return about_start(course, 40, forward_offset); },
     no_sway},
    {"rotate",
     [](const Course& course, double) { return about_start(course, 40, rotate_offset); },
     no_sway},
    {"still", [](const Course& course, double) { return std::vector(4, course.start); }, no_sway},
}};

}  // namespace

Motion::Motion(std::vector<MotionKey> keys, double duration_s, const CameraShake& sway)
    : keys_(std::move(keys)), duration_s_(duration_s) {
  WAYMARK_CHECK(keys_.size() >= 4 && duration_s > 0.0);
  if (sway.position_m <= 0.0 && sway.angle_deg <= 0.0) return;
  Rng rng(sway.seed, 0);
  for (int i = 0; i < kNumWaves; ++i) {
    // Faster waves are smaller, so that all shake about as fast.
    const double frequency =
        sway.lowest_hz * std::pow(5.0, static_cast<double>(i) / (kNumWaves - 1));
    const double share = sway.lowest_hz / frequency;
    const Vector3d position = random_signs(rng, sway.position_m * share);
    const Vector3d angle = random_signs(rng, sway.angle_deg * share);
    waves_.push_back({position, angle, frequency, rng.uniform(0.0, kTwoPi)});
  }
}

MotionKey Motion::spline(double seconds) const {
  const double segments = static_cast<double>(keys_.size() - 3);
  const double at = std::clamp(seconds / duration_s_, 0.0, 1.0) * segments;
  const std::size_t first = std::min(static_cast<std::size_t>(at), keys_.size() - 4);
  const double t = at - static_cast<double>(first);
  const double s = 1.0 - t;
  MotionKey sum;
  add_scaled(keys_[first], s * s * s / 6.0, sum);
  add_scaled(keys_[first + 1], (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, sum);
  add_scaled(keys_[first + 2], (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0, sum);
  add_scaled(keys_[first + 3], t * t * t / 6.0, sum);
  return sum;
}

MotionKey Motion::key(double seconds) const {
  const double clamped = std::clamp(seconds, 0.0, duration_s_);
  MotionKey key = spline(clamped);
  for (const Wave& wave : waves_) {
    const double value = std::sin(kTwoPi * wave.frequency_hz * clamped + wave.phase_rad);
    key.position += value * wave.position_m;
    key.yaw_deg += value * wave.angle_deg.x();
    key.pitch_deg += value * wave.angle_deg.y();
    key.roll_deg += value * wave.angle_deg.z();
  }
  return key;
}

std::vector<std::string> motion_names() {
  std::vector<std::string> names;
  for (const NamedMotion& motion : kMotions) names.emplace_back(motion.name);
  return names;
}

Motion make_motion(std::string_view world, std::string_view name, double duration_s) {
  const std::vector<Course> all = courses();
  const auto course = std::find_if(
      all.begin(), all.end(), [&](const Course& candidate) { return candidate.world == world; });
  if (course == all.end()) {
    throw InputError("world '" + std::string(world) + "'",
                     "has no motions, expected a known world");
  }
  for (const NamedMotion& motion : kMotions) {
    if (motion.name != name) continue;
    return Motion(motion.keys(*course, duration_s), duration_s, motion.sway(*course));
  }
  throw InputError(fmt::format("motion '{}'", name),
                   fmt::format("unknown, expected one of {}", fmt::join(motion_names(), ", ")));
}

}  // namespace waymark
