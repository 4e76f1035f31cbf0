// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>

#include "waymark/camera/camera.h"

namespace waymark {

/// Radians per degree.
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// What kind of camera made the images.
enum class LensModel { kPerspective, kFisheye, kEquirectangular };

/// "perspective", "fisheye", "equirectangular".
std::string_view to_string(LensModel model);

/// The numbers of a lens that images tell, as changes from a camera: logarithm of the focal length,
/// logarithm of its ratio of vertical to horizontal, principal point (2, px), the first two
/// coefficients of the distortion.
using LensChange = Eigen::Matrix<double, 6, 1>;

/// How far the truth of an unknown lens may lie from what is assumed, per number: square pixels,
/// principal point at the image's centre and little distortion. focal_sigma: of the logarithm of
/// the focal length.
LensChange lens_sigmas(int width_px, double focal_sigma);

/// A camera of this kind without distortion, principal point at the image's centre. A fisheye image
/// (equidistant) and a perspective one have the focal length, in px; a 360 degree image has none.
CameraDescription make_lens(LensModel model, double focal_px, int width_px, int height_px);

/// Focal length of an image that is that wide, for a horizontal field of view.
double focal_length_of(LensModel model, double fov_rad, int width_px);

/// A lens of the division model (camera/division.h) as one of radtan or equidistant coefficients:
/// by least squares over the radii up to the corner of the image.
CameraDescription with_coefficients(LensModel model,
                                    double focal_px,
                                    double division,
                                    const CameraDescription& size);

/// The horizontal field of view between the middles of the borders, in radians, distortion
/// included; 2 pi for 360 degree images and where a border has no direction.
double horizontal_fov_rad(const Camera& camera);

/// The camera that is described; null where there is none.
std::shared_ptr<const Camera> make_if_possible(const CameraDescription& description);

/// A camera with its numbers changed.
struct Lens {
  CameraDescription description;         ///< Its numbers.
  std::shared_ptr<const Camera> camera;  ///< Made of them; never null.
};
/// The camera that is described with its numbers changed; nothing where there is no such camera.
std::optional<Lens> changed(const CameraDescription& description, const LensChange& change);

/// The camera of images that are larger by a factor; the corner of the image stays where it is.
CameraDescription enlarged(CameraDescription description,
                           double factor,
                           int width_px,
                           int height_px);

}  // namespace waymark
