// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/frame_state.h"

#include "waymark/base/check.h"

namespace waymark {

std::string_view to_string(FrameState state) {
  switch (state) {
    case FrameState::kInitializing:
      return "initializing";
    case FrameState::kTracked:
      return "tracked";
    case FrameState::kFilled:
      return "filled";
    case FrameState::kLost:
      return "lost";
    case FrameState::kUnreadable:
      return "unreadable";
    case FrameState::kDropped:
      return "dropped";
  }
  fail_check("known FrameState", __FILE__, __LINE__);
}

std::string_view to_string(FrameReason reason) {
  switch (reason) {
    case FrameReason::kNone:
      return "none";
    case FrameReason::kNoFeatures:
      return "no_features";
    case FrameReason::kTooLittleParallax:
      return "too_little_parallax";
    case FrameReason::kTooFewMatches:
      return "too_few_matches";
    case FrameReason::kTooFewInliers:
      return "too_few_inliers";
    case FrameReason::kNoCandidate:
      return "no_candidate";
    case FrameReason::kNotVerified:
      return "not_verified";
    case FrameReason::kUnreadableImage:
      return "unreadable_image";
    case FrameReason::kWrongSize:
      return "wrong_size";
    case FrameReason::kLate:
      return "late";
  }
  fail_check("known FrameReason", __FILE__, __LINE__);
}

}  // namespace waymark
