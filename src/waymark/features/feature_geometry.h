// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/features/features.h"

namespace waymark {

/// Fills in what follows from the keypoints and the cameras: bearings, level_pixel_from_bearing,
/// size_rad and the grid of the primary features. For features that do not come from images: those
/// of FrameBuilder are the same bits for camera 0, and for camera 1, whose pixels it knows to more
/// digits than keypoints have, the same but for rounding. num_primary and the keypoints must be
/// there, and the cameras of the keypoints in the rig. Gives per keypoint whether its pixel has a
/// bearing; where it has none, what was filled in is unspecified.
std::vector<std::uint8_t> derive_geometry(const Rig& rig, Features& features);

/// Leaves of level_pixel_from_bearing of points on edges what is across.
void keep_across(Features& features);

/// The unit vector in its camera at a right angle to the bearing of a point on an edge in which the
/// distance from the edge grows fastest.
Eigen::Vector3d edge_normal_in_cam(const Features& features, std::size_t feature);

/// Ranges of the primary features that have a partner in camera 1, with their standard deviations:
/// from the angle between the two in the epipolar plane. rig: two cameras, some distance apart.
void measure_stereo_ranges(const Rig& rig, Features& features);

/// Features and in addition points of camera 0 that were found otherwise, without range: they
/// become its last corners. Keypoints and descriptors of these are parallel.
Features with_points(const Features& features,
                     std::span<const Keypoint> keypoints,
                     std::span<const Descriptor> descriptors);

/// The same features as a rig of the same cameras measures them that is calibrated otherwise:
/// bearings, level_pixel_from_bearing, sizes and ranges anew. Where a pixel has no bearing any more
/// all of that stays as it was. motion: of the rig while they were seen.
std::shared_ptr<const Features> recompute(const Features& features,
                                          std::shared_ptr<const Rig> rig,
                                          const RigMotion& motion);

/// The same features of a rig that moved otherwise while they were seen.
std::shared_ptr<const Features> moved(std::shared_ptr<const Features> features,
                                      const RigMotion& motion);

}  // namespace waymark
