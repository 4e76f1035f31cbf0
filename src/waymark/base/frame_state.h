// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include "waymark/base/id.h"

namespace waymark {

/// What became of one input frame.
enum class FrameState : std::uint8_t {
  kInitializing,  ///< Seen while the first map was not made yet.
  kTracked,
  kFilled,      ///< Got its pose after the fact, for example from before the initialisation.
  kLost,        ///< No pose.
  kUnreadable,  ///< The image could not be used.
  kDropped,     ///< Skipped because it came too late.
};

/// Why a frame has no pose.
enum class FrameReason : std::uint8_t {
  kNone,
  kNoFeatures,
  kTooLittleParallax,
  kTooFewMatches,  ///< Too few features look like those of the map or of the reference frame.
  kTooFewInliers,  ///< Too few of them agree on a pose.
  kNoCandidate,    ///< Relocalisation found no similar place.
  kNotVerified,    ///< There was a pose, but from there more should have been recognised.
  kUnreadableImage,
  kWrongSize,
  kLate,
};

/// What became of a frame, in short.
struct FrameStatus {
  FrameState state = FrameState::kLost;     ///< What became of it.
  FrameReason reason = FrameReason::kNone;  ///< Why it has no pose.
  /// Landmarks found in the image; without a pose, of the place in the map that came closest.
  int num_matches = 0;
  int num_inliers = 0;     ///< Those that agree with the pose; the same.
  int num_candidates = 0;  ///< Places in the map compared when all else had failed.
  SubmapId submap = {};    ///< Whose frame the pose is in; invalid without one.
};

/// Names as written to result files, for example "initializing", "too_few_matches".
std::string_view to_string(FrameState state);
/// Its name as written to result files.
std::string_view to_string(FrameReason reason);

}  // namespace waymark
