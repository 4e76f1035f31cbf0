// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/base/thread_pool.h"
#include "waymark/camera/camera.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"
#include "waymark/simulate/rectification_error.h"
#include "waymark/simulate/world.h"

namespace waymark {

/// What a sensor does to a perfect image.
struct ImageEffects {
  double gain = 1.0;         ///< Exposure; bright parts saturate at 255.
  double noise_sigma = 0.0;  ///< Of the grey value, after the gain.
  /// Time the shutter is open, centred on the frame's time; what moves meanwhile blurs.
  double exposure_s = 0.0;
  double inverse_depth_sigma = 0.0;  ///< Of the depth image, in 1/m, as of disparity.
};

/// Applies gain and noise. Noise is the sum of eight uniform numbers, which is normal to within
/// 4.9 sigma.
void apply_exposure(const ImageEffects& effects, Rng& rng, Image& image);

/// Adds noise to the inverse depth; what leaves the 16 bits becomes 0.
void apply_depth_noise(const ImageEffects& effects,
                       double units_per_metre,
                       Rng& rng,
                       DepthImage& depth);

/// Ray-casts a world for one camera of any model. Bearings are tabulated once. A pixel is the mean
/// over its square: read from the texture with the pixel's footprint where one surface fills it,
/// from 3 x 3 rays where an edge runs through. Pixels without bearings at all corners are 0. The
/// result is the same for any number of threads. time_s: of the walks of the world.
class Renderer {
 public:
  /// Neither is null. The camera sees elsewhere than it says by the error.
  Renderer(std::shared_ptr<const World> world,
           std::shared_ptr<const Camera> camera,
           const RectificationError& error = {});

  /// What the camera sees.
  Image image(const Rigid3& world_from_cam, ThreadPool& pool, double time_s = 0.0) const;

  /// The same with a rolling shutter: each row is seen from a pose of its own. Who walks stands
  /// still meanwhile.
  Image rolling_image(const std::function<Rigid3(int row)>& world_from_cam,
                      ThreadPool& pool,
                      double time_s = 0.0) const;

  /// Depth along the camera's z axis, exact at the pixel's centre, in units of 1/units_per_metre,
  /// rounded; 0 where there is none, or it is behind the camera or above 65535.
  DepthImage depth(const Rigid3& world_from_cam,
                   double units_per_metre,
                   ThreadPool& pool,
                   double time_s = 0.0) const;

  /// Angle between neighbouring pixels in the middle of the image.
  double pixel_rad() const;

 private:
  struct View;
  struct Tile;

  void shade_tile(const View& view, const Tile& tile, Image& result) const;
  void measure_tile(const View& view, const Tile& tile, DepthImage& result) const;
  template <class Body>
  void for_tiles(ThreadPool& pool, int tile_height, Body body) const;

  std::shared_ptr<const World> world_;
  std::shared_ptr<const Camera> camera_;
  std::vector<Eigen::Vector3f> corner_bearings_;  ///< (width + 1) x (height + 1); 0: none.
  std::vector<Eigen::Vector3d> centre_bearings_;  ///< width x height; 0: none.
};

}  // namespace waymark
