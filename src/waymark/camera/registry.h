// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Models by the names that files use.
//
//   CameraRegistry registry = CameraRegistry::with_builtin_models();
//   registry.add("my_camera", [&](const CameraDescription& description) {
//     expect_intrinsics(description, "fu fv pu pv");
//     return CameraRegistry::with_builtin_models().make_camera(description);
//   });
//   const StoredMap stored = load_map("house.wmap", registry);

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "waymark/camera/camera.h"

namespace waymark {

/// The camera models that descriptions may name. A value: extend a copy and hand it on.
class CameraRegistry {
 public:
  /// The models of this library.
  static CameraRegistry with_builtin_models();

  /// Adds a model; its name must be new.
  void add(std::string name, CameraFactory factory);

  /// Checks what all models share (resolution, finite numbers) and calls the model's factory.
  std::shared_ptr<const Camera> make_camera(const CameraDescription& description) const;
  /// The same for a camera of a map, whose model may be unknown here: then one that cannot
  /// project.
  std::shared_ptr<const Camera> make_stored_camera(const CameraDescription& description) const;

 private:
  std::string expected_models() const;

  std::map<std::string, CameraFactory, std::less<>> factories_;
};

/// For factories: InputError unless the numbers of intrinsics and distortion coefficients are
/// right. `names` lists the intrinsics, for example "fu fv pu pv".
void expect_intrinsics(const CameraDescription& description, std::string_view names);
/// For factories of models without separate distortion.
void expect_no_distortion(const CameraDescription& description);

}  // namespace waymark
