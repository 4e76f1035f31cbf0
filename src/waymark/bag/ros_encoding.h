// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace waymark {

/// How the messages of a topic are written.
enum class RosEncoding {
  kRos1,
  kCdr,      ///< Of ROS 2.
  kUnknown,  ///< Not ROS: is counted, not read.
};

}  // namespace waymark
