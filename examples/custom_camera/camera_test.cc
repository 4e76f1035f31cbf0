// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The test that every camera model of the library passes, for models of one's own.
#include "waymark/camera/testing/camera_test.h"

#include "dual_fisheye_camera.h"
#include "mirror_camera.h"
#include "waymark/camera/camchain.h"

namespace waymark {
namespace {

std::shared_ptr<const Camera> camera_of(const char* file) {
  CameraRegistry registry = CameraRegistry::with_builtin_models();
  MirrorModel::add_to(registry);
  DualFisheyeCamera::add_to(registry);
  const auto path = std::string(SETTINGS_FOLDER) + "/" + file;
  const auto chain = read_camchain(parse_config(ConfigSource::from_file(path)));
  return make_rig(chain.value(), registry).cameras[0].camera;
}

TEST(Mirror, IsSound) { expect_camera_is_sound(*camera_of("mirror.yaml")); }

TEST(DualFisheye, IsSound) { expect_camera_is_sound(*camera_of("dual_fisheye.yaml")); }

}  // namespace
}  // namespace waymark
