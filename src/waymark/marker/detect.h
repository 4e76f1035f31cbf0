// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "waymark/camera/camera.h"
#include "waymark/camera/rig.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"
#include "waymark/marker/family.h"
#include "waymark/marker/marker.h"

namespace waymark {

/// Where a marker should be seen.
struct ExpectedMarker {
  int id = 0;              ///< Its number within the family.
  double side = 0.0;       ///< Of its black square, in the unit of the pose.
  Rigid3 cam_from_marker;  ///< To within two pixels.
};

/// Finds the markers of a family in images of any central camera. Candidates and numbers are
/// OpenCV's (Garrido-Jurado et al. 2014); corners are measured anew as meetings of the outline's
/// sides, see refine_marker_corners(). The same image gives the same result.
class MarkerDetector {
 public:
  /// Of one family.
  explicit MarkerDetector(MarkerFamily family) : family_(std::move(family)) {}

  /// The markers of an image of that camera, by id. Those whose corners are not all in the field of
  /// view or whose outline does not fit a square's are left out. camera_index: of the observations.
  MarkerObservations detect(ImageView image, const Camera& camera, std::uint8_t camera_index) const;

  /// Those of expected markers that the image shows where they are expected, see fit_pattern(). As
  /// their numbers need not be read, they may be far smaller and seen from further aside.
  MarkerObservations confirm(ImageView image,
                             const Camera& camera,
                             std::uint8_t camera_index,
                             std::span<const ExpectedMarker> expected) const;

  /// What is looked for.
  const MarkerFamily& family() const { return family_; }

 private:
  MarkerFamily family_;
};

/// The same observations as a rig that is calibrated otherwise measures their pixels, without those
/// that it has no bearings of; null as it was.
std::shared_ptr<const MarkerObservations> recompute(
    const std::shared_ptr<const MarkerObservations>& observations, const Rig& rig);

}  // namespace waymark
