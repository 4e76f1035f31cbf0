// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "waymark/exchange/export_scene.h"
#include "waymark/image/image.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// Which frames of a recording become views.
enum class FrameChoice {
  kKeyframes,
  kAll,       ///< Every frame that has a pose.
  kEvery,     ///< Each n-th of these.
  kSharpest,  ///< At most n: the sharpest of each of n equal parts of the way.
};

/// What the decimals of a trajectory's file may take from a time.
inline constexpr std::int64_t kSameTimeNs = 1000;

/// A choice and its number.
struct ExportedFrames {
  FrameChoice choice = FrameChoice::kKeyframes;
  std::size_t number = 1;  ///< Of kEvery and kSharpest, at least 1.
};

/// Where the rig was at the moment of a frame, and what the recording has of it.
struct FramePlace {
  std::int64_t timestamp_ns = 0;  ///< Of the frame.
  Rigid3 rig_from_world = {};     ///< In metres (map units where the scale is free).
  KeyframeId nearest = {};        ///< In time: whose cameras took the frame, or the frame itself.
  std::size_t index = 0;          ///< In the whole recording.
  double sharpness = 0.0;         ///< See sharpness().
  std::size_t num_images = 1;     ///< 2 where there is one of camera 1.
};

/// The keyframes of a sub-map, by time.
std::vector<FramePlace> keyframe_places(const Map& map, SubmapId submap);

/// The frames of a trajectory of camera 0 around the keyframes of a sub-map, by time: each moves
/// with the keyframe that is nearest in time, so that the trajectory may be the one from before the
/// map was scaled, turned or joined with another. Empty if the trajectory has none of the
/// keyframes. InputError, which names `name`, if it says something else about how they lie to each
/// other.
std::vector<FramePlace> place_frames(const Map& map,
                                     SubmapId submap,
                                     std::span<const StampedPose> trajectory,
                                     const std::string& name);

/// The variance of the Laplacian of an image, in squared grey values (Pech-Pacheco et al. 2000):
/// comparable among images of the same scene alone.
double sharpness(ImageView image);

/// Of frames by time the indices of those that the selection takes, ascending. Steps of the way are
/// measured as seen: the angle turned plus the distance moved by the median distance of the points
/// (scene_distance, in units of the places; more than 0).
std::vector<std::size_t> choose_frames(std::span<const FramePlace> places,
                                       const ExportedFrames& selection,
                                       double scene_distance);

/// Median distance of the points of a scene to the views that see them; 1 if there are none.
double median_distance(const ExportScene& scene);

/// The scene, which has all cameras of the keyframes, with these frames as its views, by time, and
/// then by camera: keyframes among them keep their features, others have none; further keyframes
/// go. All points stay; those that fewer than two views still see have no observations. Image files
/// are named by the index of the frame and its time.
ExportScene with_frames(const ExportScene& scene,
                        const Map& map,
                        std::span<const FramePlace> places);

}  // namespace waymark
