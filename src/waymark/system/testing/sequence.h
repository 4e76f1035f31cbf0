// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/simulate/sequence.h"
#include "waymark/system/system.h"

namespace waymark {

/// Sideways through a room, small images with depth.
inline constexpr int kNumFrames = 25;

inline SequenceSpec small_spec() {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  camera.intrinsics = {210.0, 210.0, 159.5, 119.5};
  camera.width_px = 320;
  camera.height_px = 240;
  SequenceSpec spec;
  spec.name = "small";
  spec.motion = "slide";
  spec.seed = 3;
  spec.num_frames = kNumFrames;
  spec.chain = rgbd_chain(camera, 1000.0);
  return spec;
}

/// Rendered once for all tests of a program.
inline const std::vector<SimulatedFrame>& frames() {
  static const std::vector<SimulatedFrame> rendered = [] {
    SimulatedSequence sequence(small_spec());
    std::vector<SimulatedFrame> result;
    for (int i = 0; i < kNumFrames; ++i) result.push_back(sequence.frame(i));
    return result;
  }();
  return rendered;
}

inline Rig small_rig() { return SimulatedSequence(small_spec()).rig(); }

inline Settings small_settings() {
  Settings settings;
  settings.features.count = 500;
  settings.tracking.keyframe_parallax_px = 6.0;  // Several keyframes in a short sequence.
  return settings;
}

inline FrameImages input_of(const SimulatedFrame& frame) {
  FrameImages input;
  input.timestamp_ns = frame.timestamp_ns;
  input.image0 = frame.images[0].view();
  input.depth = frame.depth.view();
  return input;
}

}  // namespace waymark
