// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/geometry/rigid3.h"

namespace waymark {

/// Where the rig is and looks: yaw 0 looks along +x, 90 along +y; pitch up and roll clockwise are
/// positive. The world's z axis points up.
struct MotionKey {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< In the world, in metres.
  double yaw_deg = 0.0;                                ///< To the left, seen from above.
  double pitch_deg = 0.0;                              ///< Upwards.
  double roll_deg = 0.0;                               ///< Clockwise.
};

/// Pose of the rig (axes of camera 0: x right, y down, z forward).
Rigid3 pose_of(const MotionKey& key);

/// How much a hand or a step shakes the rig: amplitudes of a few sines over 2.3 octaves.
struct CameraShake {
  double position_m = 0.0;  ///< Amplitude along each axis.
  double angle_deg = 0.0;   ///< Amplitude of yaw, pitch and roll.
  std::uint64_t seed = 0;   ///< Of frequencies and phases.
  double lowest_hz = 0.4;  ///< Frequency of the slowest and largest sine; the quickest has 5 times.
};

/// How the rig moves at a moment. Vectors are in the world.
struct MotionState {
  Rigid3 world_from_rig;                 ///< Where it is.
  Eigen::Vector3d velocity;              ///< Of the rig's origin, m/s.
  Eigen::Vector3d acceleration;          ///< Of the rig's origin, m/s^2; without gravity.
  Eigen::Vector3d angular_velocity;      ///< rad/s.
  Eigen::Vector3d angular_acceleration;  ///< rad/s^2.
};

/// A camera motion with continuous acceleration: a uniform cubic B-spline (de Boor 1978) whose
/// control points are the keys, plus sway. Where four keys in a row are equal it stands still; it
/// never leaves the hull of four neighbours.
class Motion {
 public:
  /// At least four keys.
  Motion(std::vector<MotionKey> keys, double duration_s, const CameraShake& sway = {});

  /// Time from the first pose to the last.
  double duration_s() const { return duration_s_; }
  /// Pose at a time of [0, duration]; times outside are moved to the nearer end.
  Rigid3 world_from_rig(double seconds) const;
  /// The same as position and angles.
  MotionKey key(double seconds) const;
  /// The pose and its derivatives, by differences in time. Beyond [0, duration] it goes on at the
  /// rates of the nearer end, as what is measured before the first image and after the last.
  MotionState state(double seconds) const;

 private:
  struct Wave {
    Eigen::Vector3d position_m;
    Eigen::Vector3d angle_deg;  ///< Yaw, pitch, roll.
    double frequency_hz;
    double phase_rad;
  };

  MotionKey spline(double seconds) const;

  std::vector<MotionKey> keys_;
  double duration_s_;
  std::vector<Wave> waves_;
};

// Keys of a Motion of duration_s that goes along the whole of another, in a time of its own. What
// the other takes for it does not count.

/// As a car does: it moves where it looks, at a constant speed but for two stops, of a tenth of the
/// time each.
std::vector<MotionKey> drive_along(const Motion& way, double duration_s);

/// As a quadrotor does: ahead, rising and sinking by 0.15 m, and tilted so that it has no specific
/// force sideways or ahead (banked turns).
std::vector<MotionKey> fly_along(const Motion& way, double duration_s);

/// Standing at its start for rest_s, or half of the time where that is shorter, then going on.
std::vector<MotionKey> rest_before(const Motion& way, double rest_s, double duration_s);

/// Names that make_motion() knows:
///   loop       once around the path of the world and a bit on, looking along it and around
///   rounds     three times around and a bit on, over the same ground
///   thirty_rounds  thirty times around, each time looking at the same
///   fast_turn  the path of one loop, with quick turns of the head
///   turns_150, turns_250, turns_400  looking around slowly, then with turns of so many degrees per
///              second
///   standing_start  at rest for 5 s, then a loop
///   drive      a loop as of a car: it looks where it goes, at a constant speed, and stops twice
///   flight     a loop as of a quadrotor, with banked turns
///   shaken     as inspect, by a hand that shakes at up to 5 Hz
///   inspect    hand-held, around the starting place
///   slide      to the side and back
///   forward    ahead and back
///   rotate     turning on the spot
///   still      not moving at all
std::vector<std::string> motion_names();

/// Makes a motion that keeps clear of what stands in the named world (see make_world()). Throws
/// InputError for an unknown name.
Motion make_motion(std::string_view world, std::string_view name, double duration_s);

}  // namespace waymark
