// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "waymark/bag/ros_messages.h"
#include "waymark/camera/camchain.h"
#include "waymark/input/bag_topics.h"

namespace waymark {

/// What a sensor_msgs/CameraInfo says of a camera. is_rectified: of its rectified images, which
/// are those of a pinhole camera and P; otherwise K and D hold. Binning and region of interest are
/// those of the images. Nothing where it is not calibrated. Throws InputError at `where` for a
/// model that has no counterpart.
std::optional<ChainCamera> camera_of_info(const RosCameraInfo& info,
                                          bool is_rectified,
                                          const std::string& where);

/// Where the right camera of a pair is: R and P of both, which the stereo calibration of ROS writes
/// so that all points of the rectified cameras differ by the baseline, -P[3] / P[0]. Nothing where
/// there is none. Throws InputError at `where` for an R that is no rotation.
std::optional<Rigid3> right_from_left(const RosCameraInfo& left,
                                      const RosCameraInfo& right,
                                      bool is_rectified,
                                      const std::string& where);

/// The calibration that the bag carries for the topics. Nothing where it has none of one of them.
std::optional<CameraChain> calibration_of(Bag& bag, const TopicChoice& choice);

}  // namespace waymark
