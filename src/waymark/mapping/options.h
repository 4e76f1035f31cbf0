// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The constants of mapping, stage by stage, each with its reason. They are no promises as settings
// are, but an experiment can change them without a build:
//
//   waymark run SEQUENCE --set experiment.mapping.culling.redundant_ratio=0.9

#include "waymark/base/settings.h"

namespace waymark {

/// Of mapping/cull.h.
struct CullingOptions {
  int recent_keyframes = 3;       ///< In which a new landmark has to be found again.
  double min_found_ratio = 0.25;  ///< Of the frames in which it should have been seen.
  /// A keyframe is redundant when this part of its landmarks is seen by enough others.
  double redundant_ratio = 0.92;
  int redundant_observers = 3;  ///< So many are enough.
  int num_newest = 3;           ///< These stay: the tracker and pending messages refer to them.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("recent_keyframes", self.recent_keyframes, within(1, 100));
    field("min_found_ratio", self.min_found_ratio, within(0, 1));
    field("redundant_ratio", self.redundant_ratio, within(0, 1));
    field("redundant_observers", self.redundant_observers, within(1, 100));
    field("num_newest", self.num_newest, within(3, 100));
  }
};

/// Of mapping/triangulate.h.
struct TriangulationOptions {
  int max_neighbours = 10;  ///< Keyframes that a new one is matched with.
  /// Baselines below this part of the scene's distance give no useful depth.
  double min_baseline_ratio = 0.01;
  /// The matcher has asked for enough parallax in pixels; this only guards the division.
  double min_parallax_rad = 1e-3;

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_neighbours", self.max_neighbours, within(1, 1000));
    field("min_baseline_ratio", self.min_baseline_ratio, within(0, 1));
    field("min_parallax_rad", self.min_parallax_rad, within(1e-6, 1));
  }
};

/// Of mapping/triangulate_edges.h.
struct EdgeOptions {
  int max_neighbours = 10;       ///< Keyframes in which the point is looked for.
  int min_agreeing = 3;          ///< Keyframes beside the one that the point is of.
  double max_rival_ratio = 0.5;  ///< The runner-up has at most this part of the votes.
  double min_edge_sine = 0.5;    ///< Of the angle between an edge and its epipolar plane.
  double min_edge_cos = 0.9;     ///< Between directions across an edge in two keyframes.
  /// From the point on the other edge to where the epipolar plane crosses it: it is straight so
  /// far.
  double reach_px = 8.0;
  double min_parallax_px = 3.0;   ///< Between the two edges, along the epipolar line.
  double sigma_px = 0.7;          ///< Standard deviation of a point across its edge.
  double agreement_sigmas = 2.0;  ///< Inverse ranges that differ less agree.
  /// Of the angle between the other ray and the baseline: beside it there is no crossing.
  double min_baseline_sine = 0.05;

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_neighbours", self.max_neighbours, within(1, 1000));
    field("min_agreeing", self.min_agreeing, within(2, 100));
    field("max_rival_ratio", self.max_rival_ratio, within(0, 1));
    field("min_edge_sine", self.min_edge_sine, within(0.01, 1));
    field("min_edge_cos", self.min_edge_cos, within(0, 1));
    field("reach_px", self.reach_px, within(0, 1000));
    field("min_parallax_px", self.min_parallax_px, within(0, 1000));
    field("sigma_px", self.sigma_px, within(0.01, 100));
    field("agreement_sigmas", self.agreement_sigmas, within(0.1, 100));
    field("min_baseline_sine", self.min_baseline_sine, within(1e-6, 1));
  }
};

/// Of mapping/fuse.h.
struct FuseOptions {
  int max_neighbours = 12;        ///< Keyframes whose landmarks are fused with those of a new one.
  int max_second_neighbours = 4;  ///< And of each of these.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_neighbours", self.max_neighbours, within(1, 1000));
    field("max_second_neighbours", self.max_second_neighbours, within(0, 1000));
  }
};

/// Of mapping/bundle_window.h.
struct WindowOptions {
  int max_fixed = 25;  ///< Keyframes that hold the window in place; those that share most with it.
  int num_rounds = 2;  ///< Of adjustment, with outliers left out in between.
  int max_iterations_per_round = 8;  ///< Of Levenberg-Marquardt.
  /// A round ends when an iteration lowers the cost by less than this part of it.
  double cost_tolerance = 1e-3;
  /// Where each round begins: so little that what hardly any observation holds, as the scale along
  /// the way, moves with the first step and not only when the damping has gone down.
  double damping = 1e-6;

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_fixed", self.max_fixed, within(2, 1000));
    field("num_rounds", self.num_rounds, within(1, 100));
    field("max_iterations_per_round", self.max_iterations_per_round, within(1, 1000));
    field("cost_tolerance", self.cost_tolerance, within(1e-12, 1));
    field("damping", self.damping, within(1e-12, 1));
  }
};

/// Of all stages of mapping.
struct MappingOptions {
  CullingOptions culling;              ///< Landmarks and keyframes that go again.
  TriangulationOptions triangulation;  ///< New landmarks at corners.
  EdgeOptions edges;                   ///< New landmarks at edges.
  FuseOptions fusing;                  ///< Landmarks that are one and the same.
  WindowOptions window;                ///< Local bundle adjustment.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("culling", self.culling, {});
    field("triangulation", self.triangulation, {});
    field("edges", self.edges, {});
    field("fusing", self.fusing, {});
    field("window", self.window, {});
  }
};

}  // namespace waymark
