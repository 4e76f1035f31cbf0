// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "waymark/image/image.h"

namespace waymark {

/// The images of one moment. Views are borrowed for the duration of the call.
struct FrameImages {
  std::int64_t timestamp_ns = 0;  ///< Increases from frame to frame.
  ImageView image0 = {};          ///< Camera 0, grey, of the size its calibration states.
  ImageView image1 = {};          ///< Camera 1 of a stereo rig; empty otherwise.
  DepthView depth = {};  ///< Depth along z registered to camera 0; empty where there is none.
  ImageView mask = {};   ///< Of camera 0; no features where it is 0. Empty: everything is used.
};

}  // namespace waymark
