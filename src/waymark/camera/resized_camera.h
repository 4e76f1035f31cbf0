// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "waymark/camera/camchain.h"

namespace waymark {

/// The last numbers of a camera whose image is that of a plane: fu fv pu pv, in pixels.
inline constexpr std::size_t kNumPlaneIntrinsics = 4;

/// Whether it is of a model of ours whose intrinsics end with these.
bool has_image_plane(const CameraDescription& camera);

/// The camera of images that are resized by the factor, their size rounded down; the corner of the
/// image stays where it is. Nothing for models that are not ours, whose numbers mean anything.
std::optional<CameraDescription> resized(const CameraDescription& camera, double factor);
/// The same of a camera of a chain, with its standard deviations.
std::optional<ChainCamera> resized(const ChainCamera& camera, double factor);

}  // namespace waymark
