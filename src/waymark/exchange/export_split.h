// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/registry.h"
#include "waymark/exchange/export_parts.h"
#include "waymark/exchange/export_scene.h"

namespace waymark {

/// A scene whose cameras, or some of them, were replaced by perspective parts.
struct SplitScene {
  ExportScene scene;
  /// Per view of the scene the part that it is; nothing where the camera was left as it is.
  std::vector<std::optional<SplitPart>> parts;
};

/// Splits each view of a camera that is not perspective into num_views, see split_parts(). Features
/// are where they appear in each part, and masks are named like images with ".png" added, as COLMAP
/// wants it.
SplitScene split_scene(const ExportScene& scene, int num_views, const CameraRegistry& registry);

/// Replaces each camera by one without distortion that looks the same way, see undistorted_part().
SplitScene undistort_scene(const ExportScene& scene, const CameraRegistry& registry);

/// Writes images of views as their parts show them, and the masks that belong to them, below two
/// folders by the names of the views. Throws OutputError.
class SplitImageWriter {
 public:
  SplitImageWriter(std::filesystem::path images_folder, std::filesystem::path masks_folder);
  ~SplitImageWriter();
  SplitImageWriter(const SplitImageWriter&) = delete;
  SplitImageWriter& operator=(const SplitImageWriter&) = delete;

  /// The image that a view, or the wide one that it is a part of, was taken with.
  void write(const SplitScene& split, std::size_t view, const std::string& jpeg);

 private:
  class PartWriter;

  const std::filesystem::path images_folder_;
  const std::filesystem::path masks_folder_;
  std::vector<std::unique_ptr<PartWriter>> writers_;  // Per part of a camera.
};

/// Writes the images of all views of camera 0 that are there, and tells how many.
std::size_t write_split_images(const std::filesystem::path& images_folder,
                               const std::filesystem::path& masks_folder,
                               const SplitScene& split,
                               const KeyframeImages& images);

}  // namespace waymark
