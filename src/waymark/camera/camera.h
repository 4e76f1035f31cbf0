// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Directions to pixels and back, whole arrays at a time.
//
//   const Camera& camera = *rig.cameras[0].camera;
//   const std::vector<Eigen::Vector2d> pixels = {{320.0, 240.0}};
//   std::vector<Eigen::Vector3d> bearings(pixels.size());
//   std::vector<std::uint8_t> is_valid(pixels.size());
//   camera.unproject(pixels, bearings, is_valid);
//   if (is_valid[0]) std::cout << bearings[0].transpose() << "\n";

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// Derivative of a pixel by a point, double precision.
using Matrix23d = Eigen::Matrix<double, 2, 3>;
/// The same in single precision, as features hold it.
using Matrix23f = Eigen::Matrix<float, 2, 3>;

/// A central camera: maps points of its own frame (x right, y down, z forward, metres) to pixels,
/// (0, 0) being the centre of the top-left pixel, and pixels to unit bearings. Works on whole
/// arrays, so that the virtual call is paid once per array. Immutable, hence free to share.
class Camera {
 public:
  virtual ~Camera() = default;

  /// Name of the model as in settings files, for example "pinhole".
  virtual std::string_view model() const = 0;

  /// Width of the image.
  int width_px() const { return width_px_; }
  /// Height of the image.
  int height_px() const { return height_px_; }

  /// Projects points (any distance but 0). is_visible is 1 where the point lies in the model's
  /// field of view and its pixel within the image, else 0 and the pixel is unspecified.
  virtual void project(std::span<const Eigen::Vector3d> points_in_cam,
                       std::span<Eigen::Vector2d> pixels,
                       std::span<std::uint8_t> is_visible) const = 0;

  /// As project, with the derivative of the pixel by the point, 2x3 in px/m.
  virtual void project_with_jacobian(std::span<const Eigen::Vector3d> points_in_cam,
                                     std::span<Eigen::Vector2d> pixels,
                                     std::span<Matrix23d> pixel_from_point,
                                     std::span<std::uint8_t> is_visible) const = 0;

  /// Unit bearings of pixels; is_valid is 0 where a pixel has none (outside the image circle).
  virtual void unproject(std::span<const Eigen::Vector2d> pixels,
                         std::span<Eigen::Vector3d> bearings,
                         std::span<std::uint8_t> is_valid) const = 0;

  /// False only for a camera of a map whose model is unknown here (UnknownCamera): then the
  /// functions above throw InputError.
  virtual bool can_project() const { return true; }

  /// Width after which columns repeat (360 degree images), or 0.
  virtual double wrap_width_px() const { return 0.0; }

  /// Whether a pixel (of pixel centres) lies within the image.
  bool contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width_px_ - 0.5 &&
           pixel.y() < height_px_ - 0.5;
  }

 protected:
  /// Size of the image, both positive.
  Camera(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}

 private:
  int width_px_;
  int height_px_;
};

/// A camera in words and numbers, as settings and map files hold it.
struct CameraDescription {
  std::string camera_model;        ///< "pinhole" or the name of another registered model.
  std::vector<double> intrinsics;  ///< For pinhole fu fv pu pv, in pixels.
  /// "none", or the distortion of the model: "radtan", "equidistant".
  std::string distortion_model = "none";
  std::vector<double> distortion_coeffs;  ///< For radtan k1 k2 p1 p2, for equidistant k1 k2 k3 k4.
  int width_px = 0;                       ///< Of the images.
  int height_px = 0;                      ///< Of the images.
  std::string where;                      ///< Begins error messages, for example "camchain.yaml:3".

  /// The same camera, wherever it was written.
  bool is_same(const CameraDescription& other) const;

  /// InputError at `where`, for factories.
  [[noreturn]] void fail(const std::string& what) const;
};

/// Makes the camera that was described, or throws InputError (description.fail()) that says what is
/// wrong and what was expected.
using CameraFactory = std::function<std::shared_ptr<const Camera>(const CameraDescription&)>;

/// What one feature measures of the point that it shows.
struct Measurement {
  std::uint8_t camera = 0;                             ///< Index in the rig.
  Eigen::Vector3f bearing = Eigen::Vector3f::UnitZ();  ///< Unit, in the camera.
  /// Derivative of the pixel of the feature's level by the bearing, there (W of Features).
  Matrix23f level_pixel_from_bearing = Matrix23f::Zero();
  float inverse_range = 0.0f;        ///< 1/m, measured; see inverse_range_sigma.
  float inverse_range_sigma = 0.0f;  ///< 1/m; 0 where there is no measurement.
};

}  // namespace waymark
