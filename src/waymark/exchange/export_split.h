// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/registry.h"
#include "waymark/exchange/export_scene.h"
#include "waymark/image/image.h"

namespace waymark {

/// A perspective part of what a wide camera sees, 90 degrees wide and high.
struct SplitPart {
  std::shared_ptr<const Camera> camera;  ///< The wide one.
  Eigen::Quaterniond part_from_camera;
  int size_px = 0;        ///< Width and height; pixels are those of the middle of the wide image.
  bool sees_all = false;  ///< No part of it lies outside of the wide image or its circle.
};

/// A scene whose wide cameras (all but perspective ones) were replaced by perspective parts.
struct SplitScene {
  ExportScene scene;
  /// Per view of the scene the part that it is; nothing where the camera was left as it is.
  std::vector<std::optional<SplitPart>> parts;
};

inline constexpr int kMinSplitViews = 4;
inline constexpr int kMaxSplitViews = 32;

/// Splits each view of a camera that is not perspective into num_views. Of a 360 degree camera 6
/// are the faces of a cube, and any other number a ring around the horizon; of others one looks
/// straight ahead and the rest in a ring around it, 55 degrees off the axis. Features are where
/// they appear in each part, and masks are named like images with ".png" added, as COLMAP wants it.
SplitScene split_scene(const ExportScene& scene, int num_views, const CameraRegistry& registry);

/// Where the pixels of a part, row by row, lie in the wide image.
struct SplitLookup {
  std::vector<Eigen::Vector2d> pixels;   ///< Of the wide image.
  std::vector<std::uint8_t> is_visible;  ///< 0: outside of it or its circle.
};

/// Where a part shows something: 255, else 0 (outside of the image or its circle).
Image split_mask(const SplitPart& part);

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
