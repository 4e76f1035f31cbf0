// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The constants of loop closing, stage by stage, each with its reason. They are no promises as
// settings are, but an experiment can change them without a build:
//
//   waymark run SEQUENCE --set experiment.loop.verification.min_share=0.2

#include "waymark/base/settings.h"
#include "waymark/track/options.h"

namespace waymark {

/// Of loop/find.h.
struct CandidateOptions {
  int max_candidates = 4;  ///< Of the query's sub-map, and again of the others.
  /// Of keyframes that see the same, so many are candidates, so that others have their turn.
  int max_of_one_place = 2;
  int num_ranked = 12;              ///< Keyframes of the place index that are looked at.
  int num_near_steps = 2;           ///< Keyframes so many steps away are the query's surroundings.
  double min_relative_score = 0.1;  ///< Of the best score within the surroundings.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_candidates", self.max_candidates, within(1, 1000));
    field("max_of_one_place", self.max_of_one_place, within(1, 1000));
    field("num_ranked", self.num_ranked, within(1, 10000));
    field("num_near_steps", self.num_near_steps, within(0, 100));
    field("min_relative_score", self.min_relative_score, within(0, 1));
  }
};

/// Of loop/candidate_score.h.
struct ScoreOptions {
  int min_matches = 15;    ///< By appearance; fewer are not worth the time.
  int min_inliers = 10;    ///< Among them; fewer are not worth the time either.
  int max_distance = 64;   ///< Between descriptors, in bits.
  double max_ratio = 0.8;  ///< Of that of the next best.
  /// Standard deviation of the residuals of landmarks that were mapped independently, in pixels of
  /// the level: their own errors count, too.
  double noise_px = 1.5;
  double guided_radius_px = 8.0;       ///< Search for more matches of the two keyframes.
  double observation_radius_px = 4.0;  ///< Search for what else should be seen.
  int num_surroundings = 8;            ///< Keyframes on either side whose landmarks should be seen.
  int min_observers = 3;   ///< Landmarks that so many keyframes saw are expected to be seen again.
  int max_confirming = 5;  ///< Keyframes near the query that may confirm.
  /// Landmarks by which one does, or what is enough of its features.
  int min_found_to_confirm = 25;
  double min_share_to_confirm = 0.1;  ///< Of the landmarks that it should see.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("min_matches", self.min_matches, within(6, 1000));
    field("min_inliers", self.min_inliers, within(6, 1000));
    field("max_distance", self.max_distance, within(1, 256));
    field("max_ratio", self.max_ratio, within(0, 1));
    field("noise_px", self.noise_px, within(0.01, 100));
    field("guided_radius_px", self.guided_radius_px, within(1, 1000));
    field("observation_radius_px", self.observation_radius_px, within(1, 1000));
    field("num_surroundings", self.num_surroundings, within(0, 1000));
    field("min_observers", self.min_observers, within(1, 1000));
    field("max_confirming", self.max_confirming, within(1, 1000));
    field("min_found_to_confirm", self.min_found_to_confirm, within(1, 10000));
    field("min_share_to_confirm", self.min_share_to_confirm, within(0, 1));
  }
};

/// Of loop/verify.h.
struct VerificationOptions {
  int min_inliers_of_loop = 25;  ///< Or what is enough of the features, as those below.
  int min_found_of_loop = 40;    ///< Landmarks of the other side.
  /// Between sub-maps there is no odometry to contradict.
  int min_inliers_of_join = 30;
  int min_found_of_join = 60;  ///< Landmarks of the other side.
  double min_share = 0.15;     ///< Of what both sides should see.
  /// Features of the query that show landmarks of both sides, and their distances in the same
  /// ratio.
  int min_pairs_of_neighbours = 10;
  double max_ratio_error = 0.15;  ///< Relative.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("min_inliers_of_loop", self.min_inliers_of_loop, within(6, 10000));
    field("min_found_of_loop", self.min_found_of_loop, within(6, 10000));
    field("min_inliers_of_join", self.min_inliers_of_join, within(6, 10000));
    field("min_found_of_join", self.min_found_of_join, within(6, 10000));
    field("min_share", self.min_share, within(0, 1));
    field("min_pairs_of_neighbours", self.min_pairs_of_neighbours, within(3, 10000));
    field("max_ratio_error", self.max_ratio_error, within(0, 10));
  }
};

/// Of all stages of loop closing.
struct LoopOptions {
  CandidateOptions candidates;       ///< Keyframes that may show the same.
  ScoreOptions scores;               ///< What speaks for a candidate.
  VerificationOptions verification;  ///< Whether that is enough.
  PlaceOptions neighbours;           ///< Views that the map says to lie beside each other.
  int num_consolidated = 2;          ///< Keyframes compared with what lies beside them per new one.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("candidates", self.candidates, {});
    field("scores", self.scores, {});
    field("verification", self.verification, {});
    field("neighbours", self.neighbours, {});
    field("num_consolidated", self.num_consolidated, within(0, 100));
  }
};

}  // namespace waymark
