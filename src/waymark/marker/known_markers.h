// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "waymark/base/config.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/marker/settings.h"

namespace waymark {

/// What is known of one marker.
struct KnownMarker {
  std::optional<double> size_m;             ///< Side of its black square, where it is its own.
  std::optional<Rigid3> world_from_marker;  ///< Where it was surveyed, see marker_corner().
};

/// What is known of the markers of a place.
struct KnownMarkers {
  std::string family;                ///< One of marker_families(); empty: not said.
  double size_m = 0.0;               ///< Side of those that have none of their own; 0: not said.
  std::map<int, KnownMarker> by_id;  ///< Only those of which something is known.

  /// The side of a marker in metres; 0 where it is not known.
  double size_of(int id) const;
  /// Its surveyed pose, or null.
  const Rigid3* pose_of(int id) const;
};

/// Reads markers.yaml:
///
///   family: tag36h11
///   size: 0.16
///   markers:
///     - {id: 0, position: [0, 0, 1.2], rotation: [0.5, 0.5, 0.5, 0.5]}
///     - {id: 7, size: 0.3}
///
/// All keys but id may be missing; position (metres) and rotation (quaternion x y z w) go together.
/// What is malformed, unknown or impossible is an InputError with its line.
KnownMarkers read_known_markers(const ConfigNode& document);

/// The document that read_known_markers() reads.
std::string format_known_markers(const KnownMarkers& markers);

/// What settings and their file say of the markers to look for, the settings first. Nothing where
/// they are off; InputError where the family is unknown or sizes are missing.
std::optional<KnownMarkers> markers_to_look_for(const MarkerSettings& settings);

}  // namespace waymark
