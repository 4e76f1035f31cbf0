// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/same_rig.h"

#include <algorithm>

namespace waymark {
namespace {

bool is_same_camera(const RigCamera& a, const RigCamera& b) {
  const bool is_in_place = a.cam_from_rig.rotation.coeffs() == b.cam_from_rig.rotation.coeffs() &&
                           a.cam_from_rig.translation == b.cam_from_rig.translation;
  if (!a.description || !b.description) return is_in_place && a.camera == b.camera;
  return is_in_place && a.description->is_same(*b.description);
}

}  // namespace

bool is_same_rig(const Rig& a, const Rig& b) {
  return &a == &b || std::equal(a.cameras.begin(),
                                a.cameras.end(),
                                b.cameras.begin(),
                                b.cameras.end(),
                                is_same_camera);
}

}  // namespace waymark
