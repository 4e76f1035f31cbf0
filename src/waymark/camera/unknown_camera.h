// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "waymark/camera/camera.h"

namespace waymark {

/// A camera of a map file whose model is not registered here. It has a size and a name, so that the
/// map can be looked at and saved again; whoever needs a projection gets an InputError that names
/// the model.
class UnknownCamera final : public Camera {
 public:
  /// expected: the end of the message, what the model should have been.
  UnknownCamera(CameraDescription description, std::string expected)
      : Camera(description.width_px, description.height_px),
        description_(std::move(description)),
        expected_(std::move(expected)) {}

  std::string_view model() const override { return description_.camera_model; }
  bool can_project() const override { return false; }
  void project(std::span<const Eigen::Vector3d>,
               std::span<Eigen::Vector2d>,
               std::span<std::uint8_t>) const override {
    fail();
  }
  void project_with_jacobian(std::span<const Eigen::Vector3d>,
                             std::span<Eigen::Vector2d>,
                             std::span<Matrix23d>,
                             std::span<std::uint8_t>) const override {
    fail();
  }
  void unproject(std::span<const Eigen::Vector2d>,
                 std::span<Eigen::Vector3d>,
                 std::span<std::uint8_t>) const override {
    fail();
  }

 private:
  [[noreturn]] void fail() const {
    description_.fail("camera_model is " + description_.camera_model + ", " + expected_);
  }

  CameraDescription description_;
  std::string expected_;
};

}  // namespace waymark
