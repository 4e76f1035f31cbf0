// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/evaluate/evaluation.h"
#include "waymark/input/input.h"
#include "waymark/results/trajectory.h"
#include "waymark/session/session.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/sequence.h"
#include "waymark/system/settings.h"

namespace waymark {

/// Units of depth per metre in the sequences here.
constexpr double kDepthFactor = 5000.0;

/// A sequence held in memory, with its truth.
struct Recording {
  Rig rig;
  Setup setup = Setup::kMono;
  Settings settings;
  std::vector<InputFrame> frames;
  std::vector<StampedPose> groundtruth;
};

/// A short hand-held sequence in a room with a small distorted camera, or two that are neither
/// rectified nor quite parallel, or one with depth.
SequenceSpec small_sequence(Setup setup, int num_frames);

Recording simulate(const SequenceSpec& spec);

/// What one camera sees of the room along a motion, 20 times a second.
Recording simulate(const CameraDescription& camera, const Motion& motion);

/// Feeds the whole recording to a new System.
SessionResults map_recording(const Recording& recording, Timing timing);

/// Part of the frames that are in the largest trajectory.
double coverage(const SessionResults& results);

/// Against the truth of the recording; Sim(3) in mono, else SE(3).
Evaluation evaluate_results(const SessionResults& results, const Recording& recording);

/// Changes when any bit of any pose of the results changes.
std::uint64_t hash_of(const SessionResults& results);

}  // namespace waymark
