// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/image/image.h"

namespace waymark {

/// Puts the image of a 360 degree camera together from those of two lenses back to back, as such
/// cameras do: the half before the plane z = 0 from the front lens, the other from the back lens,
/// with a narrow blend around the plane. Nothing is moved for the distance between the lenses.
class Stitch {
 public:
  /// A camera that sees all round.
  explicit Stitch(const Camera& camera);

  /// Both of the camera's size.
  Image join(const Image& front, const Image& back) const;

 private:
  std::vector<float> front_share_;  ///< Of each pixel, from 0 to 1.
};

}  // namespace waymark
