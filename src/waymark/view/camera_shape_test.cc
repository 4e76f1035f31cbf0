// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "waymark/camera/equirectangular.h"
#include "waymark/camera/perspective.h"
#include "waymark/camera/unknown_camera.h"
#include "waymark/view/scene.h"

namespace waymark {
namespace {

using Eigen::Vector3d;

std::shared_ptr<const Camera> perspective() {
  return std::make_shared<PerspectiveCamera>(
      PerspectiveModel({300.0, 300.0}, {319.5, 239.5}), 640, 480);
}

TEST(CameraShape, CornersAreThoseOfTheImage) {
  const CameraShape shape = shape_of({perspective(), Rigid3()});
  EXPECT_FALSE(shape.is_sphere);
  EXPECT_TRUE(shape.position_in_rig.isZero());
  const std::array<Eigen::Vector2d, 4> signs = {Eigen::Vector2d(-1, -1),
                                                Eigen::Vector2d(1, -1),
                                                Eigen::Vector2d(1, 1),
                                                Eigen::Vector2d(-1, 1)};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d expected =
        Vector3d(signs[i].x() * 319.5 / 300.0, signs[i].y() * 239.5 / 300.0, 1.0).normalized();
    EXPECT_LT((shape.corners_in_rig[i] - expected).norm(), 1e-9) << "corner " << i;
  }
}

TEST(CameraShape, StandsWhereTheCameraStandsInTheRig) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.4, Vector3d::UnitY()));
  const Rigid3 cam_from_rig(turn, turn * Vector3d(-0.2, 0.1, 0.0));
  const CameraShape shape = shape_of({perspective(), cam_from_rig});
  EXPECT_LT((shape.position_in_rig - Vector3d(0.2, -0.1, 0.0)).norm(), 1e-12);
  const CameraShape straight = shape_of({perspective(), Rigid3()});
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d expected = turn.conjugate() * straight.corners_in_rig[i];
    EXPECT_LT((shape.corners_in_rig[i] - expected).norm(), 1e-12);
  }
}

TEST(CameraShape, EndsWhereTheFieldOfViewEnds) {
  // Strong distortion: the model's field of view ends within the image.
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({150.0, 150.0}, {159.5, 119.5}, std::vector<double>{-0.28, 0.0, 0.0, 0.0}),
      320,
      240);
  const CameraShape shape = shape_of({camera, Rigid3()});
  for (const Vector3d& corner : shape.corners_in_rig) {
    EXPECT_NEAR(corner.norm(), 1.0, 1e-9);
    EXPECT_GT(corner.z(), 0.0);
    EXPECT_LT(corner.z(), 0.85) << "far off the axis";
  }
  EXPECT_GT(shape.corners_in_rig[1].x(), 0.0);
  EXPECT_LT(shape.corners_in_rig[3].x(), 0.0);
}

TEST(CameraShape, OfAnUnknownModelIsWideEnoughToBeSeen) {
  CameraDescription description;
  description.camera_model = "mine";
  description.width_px = 201;
  description.height_px = 101;
  const CameraShape shape = shape_of({std::make_shared<UnknownCamera>(description, ""), Rigid3()});
  EXPECT_FALSE(shape.is_sphere);
  EXPECT_LT((shape.corners_in_rig[2] - Vector3d(1.0, 0.5, 1.0).normalized()).norm(), 1e-9);
}

TEST(CameraShape, WholeSpheresAreSpheres) {
  const auto camera =
      std::make_shared<EquirectangularCamera>(EquirectangularModel(640, 320), 640, 320);
  EXPECT_TRUE(shape_of({camera, Rigid3()}).is_sphere);
}

}  // namespace
}  // namespace waymark
