// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/rig.h"
#include "waymark/features/features.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/simulate/testing/town.h"

namespace waymark {

/// How a rig goes through a town, and how what it sees differs from the truth.
struct TownRecordingSettings {
  std::uint64_t seed = 1;  ///< Of the way and of the noise.
  std::uint32_t num_frames = 100;
  double step_m = 0.25;              ///< From frame to frame.
  double light_flips = 0.0;          ///< Share of a look's bits that are other in this light.
  double light_dropout = 0.0;        ///< Share of the points that this light does not show.
  double pixel_sigma = 0.5;          ///< In pixels of the feature's level; see PointNoise.
  double flip_probability = 0.04;    ///< Of each bit in each frame.
  double miss_probability = 0.1;     ///< Of a point in each frame.
  double inverse_range_sigma = 0.0;  ///< In 1/m; above 0 the rig measures range (RGB-D).
  double max_distance_m = 60.0;      ///< What is further away shows no corners.
  std::uint32_t max_features = 600;
};

/// What a frame shows.
struct TownFrame {
  std::shared_ptr<const Features> features;
  std::vector<std::uint32_t> point_of_feature;  ///< Id in the town, per feature of either camera.
  Rigid3 world_from_rig;                        ///< The truth.
};

/// The way of a rig through the streets: a random walk over the crossings, which comes by again in
/// either direction. Frames are made when they are asked for, each by itself: the same settings and
/// index give the same bits. Any thread.
class TownRecording {
 public:
  /// rig: one camera, or two; town and rig are never null.
  TownRecording(std::shared_ptr<const Town> town,
                std::shared_ptr<const Rig> rig,
                const TownRecordingSettings& settings);

  std::uint32_t num_frames() const { return settings_.num_frames; }
  Rigid3 world_from_rig(std::uint32_t frame) const { return stand_at(frame).world_from_rig; }
  TownFrame frame(std::uint32_t frame) const;
  /// Streets in the order in which the way takes them.
  const std::vector<std::uint32_t>& streets() const { return way_; }

 private:
  /// A straight part within a street, or the curve through the crossing behind it.
  struct Leg {
    double begin_m = 0.0;  ///< On the way.
    double length_m = 0.0;
    Eigen::Vector2d from, over, to;
    TownPlace place;
  };
  struct Stand {
    Rigid3 world_from_rig;
    TownPlace place;
  };
  struct Seen;

  void choose_way();
  void add_leg(const Eigen::Vector2d& from,
               const Eigen::Vector2d& over,
               const Eigen::Vector2d& to,
               const TownPlace& place);
  Stand stand_at(std::uint32_t frame) const;
  std::vector<Seen> see(const Stand& stand, Rng& rng) const;
  Descriptor look(const Seen& seen, const Eigen::Vector3d& eye, Rng& rng) const;
  void choose(std::vector<Seen>& seen) const;
  void add_second_camera(const Stand& stand,
                         const std::vector<Seen>& seen,
                         Rng& rng,
                         TownFrame& frame,
                         Features& features) const;

  std::shared_ptr<const Town> town_;
  std::shared_ptr<const Rig> rig_;
  TownRecordingSettings settings_;
  bool looks_ahead_only_;  ///< Camera 0 sees nothing behind it.
  std::vector<std::uint32_t> way_;
  std::vector<Leg> legs_;
};

}  // namespace waymark
