// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace waymark {

/// When results of background work become visible: the only thing that separates the modes.
enum class Timing {
  kInline,    ///< No threads; visible at fixed frames.
  kLockstep,  ///< Threads; visible at the same fixed frames, the reader waits if they are late.
  kRealtime,  ///< Threads; visible as soon as they exist, the reader never waits.
};

}  // namespace waymark
