// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The constants of tracking, stage by stage, each with its reason. They are no promises as settings
// are, but an experiment can change them without a build:
//
//   waymark run SEQUENCE --set experiment.tracking.keyframes.max_pending=3

#include "waymark/base/settings.h"

namespace waymark {

/// Of track/keyframe_decision.h.
struct KeyframeOptions {
  int max_pending = 2;  ///< Sent keyframes that may be outstanding before the tracker holds back.
  /// Where less than this part of the features with a reliable range have a landmark, most of what
  /// the camera sees is new.
  double min_known_near = 0.3;
  /// Landmarks that so many keyframes see, or all in a young map, count as established.
  int established_observers = 3;
  /// Of keyframe_parallax_px: a camera that moves less is at rest, and nothing is overdue.
  double overdue_parallax = 0.25;

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_pending", self.max_pending, within(1, 100));
    field("min_known_near", self.min_known_near, within(0, 1));
    field("established_observers", self.established_observers, within(1, 100));
    field("overdue_parallax", self.overdue_parallax, within(0, 1));
  }
};

/// Of track/stationary_camera.h.
struct StationaryOptions {
  int min_cell_matches = 3;  ///< That tell what a cell of the image does.
  int min_still_cells = 2;   ///< Of those that stayed before, so many have to stay.
  /// Of its cells, the share that stays where the camera rests: a third of what remains of the view
  /// when things have 60 % of the features; of a moving camera hardly any do.
  double rest_share = 0.15;
  double rest_share_all_around = 0.75;  ///< The same of a camera that sees all around.
  /// How far the features of a cell are off in the median, in pixels of the full image: what is far
  /// away stays within a pixel, too, but with each turn of the camera all of it moves by more.
  double stay_px = 0.5;

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("min_cell_matches", self.min_cell_matches, within(1, 1000));
    field("min_still_cells", self.min_still_cells, within(1, 24));
    field("rest_share", self.rest_share, within(0, 1));
    field("rest_share_all_around", self.rest_share_all_around, within(0, 1));
    field("stay_px", self.stay_px, within(0, 100));
  }
};

/// Of track/initializer.h.
struct InitializerOptions {
  /// A map begins with so many landmarks, or with what is enough of the features there are.
  int min_landmarks = 80;
  /// So many that a pose can rest on them even if the next frame finds just one in ten again.
  int plenty_of_landmarks = 200;
  int max_references = 8;  ///< Frames that later ones are paired with.
  /// A new one is kept every so many frames, so that slow and fast motion find a partner.
  int reference_interval = 3;
  /// Least parallax of a pair, in pixels of the full image: with about one pixel of noise, single
  /// points are then known to a tenth of their depth and the pair to much better.
  double min_parallax_px = 12.0;
  /// Four times what the tracker's prediction errs by, as here nothing is predicted.
  double search_radius_px = 60.0;
  double search_part = 1.0 / 16.0;  ///< The same as a part of the image.
  double rest_px = 3.0;  ///< What noise moves a feature by at most; at rest there is no more.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("min_landmarks", self.min_landmarks, within(10, 10000));
    field("plenty_of_landmarks", self.plenty_of_landmarks, within(10, 100000));
    field("max_references", self.max_references, within(2, 100));
    field("reference_interval", self.reference_interval, within(1, 100));
    field("min_parallax_px", self.min_parallax_px, within(0.1, 1000));
    field("search_radius_px", self.search_radius_px, within(1, 1000));
    field("search_part", self.search_part, within(0, 1));
    field("rest_px", self.rest_px, within(0, 100));
  }
};

/// Of track/pose_search.h.
struct PoseSearchOptions {
  /// For a camera turned by hand the prediction is off by 12 px of 640 x 480 in one frame of 20 and
  /// by 22 px in one of 100 (docs/decisions/track.md).
  double predicted_radius_px = 15.0;
  double predicted_part = 1.0 / 64.0;  ///< The same as a part of the image.
  double wide_radius_px = 40.0;        ///< When that fails.
  double wide_part = 1.0 / 24.0;       ///< The same as a part of the image.
  /// Around a pose that rests on what it sees; of the landmark's level (docs/decisions/track.md).
  double located_radius_px = 5.0;
  int recovery_keyframes = 12;  ///< Beside which the camera is looked for after a loss.
  int recovery_frames = 30;     ///< After a loss, in which it is looked for near where it was.
  int patience_frames = 5;      ///< After a loss, in which a place near the last pose is believed.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("predicted_radius_px", self.predicted_radius_px, within(1, 1000));
    field("predicted_part", self.predicted_part, within(0, 1));
    field("wide_radius_px", self.wide_radius_px, within(1, 1000));
    field("wide_part", self.wide_part, within(0, 1));
    field("located_radius_px", self.located_radius_px, within(1, 1000));
    field("recovery_keyframes", self.recovery_keyframes, within(1, 1000));
    field("recovery_frames", self.recovery_frames, within(0, 100000));
    field("patience_frames", self.patience_frames, within(0, 100000));
  }
};

/// Of track/pose_check.h.
struct PoseCheckOptions {
  /// Of 1465 predictions in recordings of 10 to 30 frames per second one was off by more than 0.08
  /// (docs/decisions/track.md).
  double max_surprise = 0.1;
  double max_same_distance = 0.03;  ///< Poses nearer to each other are the same.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("max_surprise", self.max_surprise, within(0, 100));
    field("max_same_distance", self.max_same_distance, within(0, 100));
  }
};

/// Of track/place_locator.h and track/relocalizer.h.
struct PlaceOptions {
  int num_matched_keyframes = 3;  ///< The candidate and those that share most landmarks with it.
  /// Of the many landmarks that look alike those remain that agree on how the camera turned, unless
  /// so few do that it may be chance: where the scene is near, the parallax differs.
  int max_distance = 60;
  double max_ratio = 0.9;         ///< Of that of the next best.
  int min_agreeing = 8;           ///< On how the camera turned.
  int min_matches = 20;           ///< Fewer are chance more often than not.
  int min_consensus = 15;         ///< On a pose; fewer are chance, too.
  double min_inlier_ratio = 0.2;  ///< Of the matches.
  /// The pose of a dozen inliers is off by some pixels, that of a hundred by less than one.
  double first_radius_px = 12.0;
  double second_radius_px = 5.0;  ///< After a first refinement.
  /// Where drift or a guess put a pose: five degrees of a lens of 460 px.
  double guess_radius_px = 40.0;
  /// Laxer than in tracking: light and cameras may have changed, and a few wrong ones do no harm.
  int guided_max_distance = 80;
  int min_inliers = 30;         ///< Or what is enough of the features there are.
  double min_confidence = 0.3;  ///< Below this the place may be one that merely looks alike.
  int max_candidates = 10;      ///< Of the place index.
  /// What merely looks alike does not get that far; the other candidates need not be tried.
  double certain_confidence = 0.5;
  /// How far a rig moves from one frame to the next at most, by the distance of what it sees.
  double max_moved_part = 0.5;
  /// Keyframes near where a marker has the rig, compared by appearance if its pose is too coarse.
  int max_near_marker = 4;

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("num_matched_keyframes", self.num_matched_keyframes, within(1, 100));
    field("max_distance", self.max_distance, within(1, 256));
    field("max_ratio", self.max_ratio, within(0, 1));
    field("min_agreeing", self.min_agreeing, within(1, 1000));
    field("min_matches", self.min_matches, within(6, 1000));
    field("min_consensus", self.min_consensus, within(6, 1000));
    field("min_inlier_ratio", self.min_inlier_ratio, within(0.01, 1));
    field("first_radius_px", self.first_radius_px, within(1, 1000));
    field("second_radius_px", self.second_radius_px, within(1, 1000));
    field("guess_radius_px", self.guess_radius_px, within(1, 1000));
    field("guided_max_distance", self.guided_max_distance, within(1, 256));
    field("min_inliers", self.min_inliers, within(6, 1000));
    field("min_confidence", self.min_confidence, within(0, 1));
    field("max_candidates", self.max_candidates, within(1, 1000));
    field("certain_confidence", self.certain_confidence, within(0, 1));
    field("max_moved_part", self.max_moved_part, within(0, 100));
    field("max_near_marker", self.max_near_marker, within(1, 1000));
  }
};

/// Of all stages of tracking.
struct TrackingOptions {
  KeyframeOptions keyframes;       ///< When a frame becomes a keyframe.
  StationaryOptions stationary;    ///< Whether the camera is at rest.
  InitializerOptions initializer;  ///< Start of a sub-map.
  PoseSearchOptions pose_search;   ///< Ways to a pose.
  PoseCheckOptions pose_check;     ///< Whether a pose is believed.
  PlaceOptions relocalization;     ///< Places seen before.

  /// Lists the fields, see SettingInfo.
  template <class Self, class Field>
  static void describe(Self& self, Field&& field) {
    field("keyframes", self.keyframes, {});
    field("stationary", self.stationary, {});
    field("initializer", self.initializer, {});
    field("pose_search", self.pose_search, {});
    field("pose_check", self.pose_check, {});
    field("relocalization", self.relocalization, {});
  }
};

}  // namespace waymark
