// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/camera/tangent.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"
#include "waymark/marker/family.h"

namespace waymark {

/// Rays per pixel and axis that patterns are drawn with.
inline constexpr int kPatternRays = 4;

/// Values of a patch, one per pixel or kPatternRays times as dense.
struct DenseImage {
  int width = 0;
  int height = 0;
  std::vector<float> values;

  float& at(int x, int y) {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  float at(int x, int y) const { return const_cast<DenseImage*>(this)->at(x, y); }
};

/// Gaussian, sigma in its own pixels.
void blur_image(DenseImage& image, double sigma);

/// A rectangle of the image with the rays of its pixels.
struct MarkerPatch {
  int x0 = 0;
  int y0 = 0;
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3d> fine_bearings;
  std::vector<std::uint8_t> is_fine_valid;
  DenseImage grey;  ///< As dense as the image.
  TangentComputer computer;
  TangentArrays tangents;
};

/// Where a ray meets the plane of a marker, by the side; nothing where it does not.
struct PlaneMeeting {
  double u = 0.0;
  double v = 0.0;
  double range = 0.0;
  bool is_ahead = false;
};

/// cam_from_marker inverted: where a bearing meets the plane, from before the marker.
PlaneMeeting meet_plane(const Rigid3& marker_from_cam, const Eigen::Vector3d& bearing);

/// White around the black square that is there for sure, by the side: a module.
double quiet_share(const MarkerFamily& family);

/// The part of an image that a marker and its white cover, with what it is blurred into; nothing
/// where it is not wholly in the image, or too large. cam_from_marker: lengths by the side.
std::optional<MarkerPatch> look_at_marker(ImageView image,
                                          const Camera& camera,
                                          const MarkerFamily& family,
                                          const Rigid3& cam_from_marker);

/// Which part of each pixel is black and which lies beyond the white.
struct PatternDrawing {
  DenseImage black;
  DenseImage outside;
};

/// As a camera sees a marker with these modules (MarkerFamily::modules()), blurred by a standard
/// deviation in pixels of the image and by the area of its pixels.
PatternDrawing draw_pattern(const MarkerPatch& patch,
                            const std::vector<std::uint8_t>& modules,
                            const MarkerFamily& family,
                            const Rigid3& cam_from_marker,
                            double blur_px);

/// Value and slope (per pixel) of a drawing at a pixel.
struct DrawnSample {
  double value;
  Eigen::RowVector2d slope;
};

/// At a pixel of the patch.
DrawnSample sample_at(const DenseImage& drawing, int x, int y);

}  // namespace waymark
