// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/camera/tangent.h"
#include "waymark/features/depth.h"
#include "waymark/features/extractor.h"
#include "waymark/features/features.h"
#include "waymark/features/pyramid.h"
#include "waymark/features/stereo.h"
#include "waymark/features/view_mask.h"
#include "waymark/image/image.h"
#include "waymark/image/seam_padding.h"

namespace waymark {

struct SmallImage;

struct FrameSettings {
  FeatureSettings features = {};
  StereoSettings stereo = {};
  DepthSettings depth = {};
  ViewSettings view = {};
};

/// Throws InputError where the size of an image is not that of its camera in the rig.
void check_sizes(const FrameImages& images, const Rig& rig);

/// What is known of the cameras when a frame is looked at. Equal are those that share all of it.
struct FrameView {
  std::shared_ptr<const Rig> rig;  ///< As calibrated then.
  std::vector<LevelMask> masks;    ///< Per camera: where features may be.

  bool operator==(const FrameView&) const = default;
};

/// What the last frame took.
struct FrameTimes {
  double features_ms = 0.0;  ///< Extraction and bearings of camera 0.
  double depth_ms = 0.0;     ///< Stereo search with the pyramid of camera 1, or the depth image.
};

/// What the images of a frame show, whatever the motion: without depth images.
struct FoundFrame {
  std::shared_ptr<Features> features;
  std::shared_ptr<const SmallImage> small_image;  ///< Of image 0.
  FrameTimes times;
};

/// Finds the features of frames: extraction, tangents, stereo. The same images in the same view
/// give the same features, whatever was looked at before; only buffers are kept.
class FeatureFinder {
 public:
  /// Throws InputError for a pair of cameras at the same place.
  FeatureFinder(const std::shared_ptr<const Rig>& rig, const FrameSettings& settings);

  /// Throws InputError where the size of an image is not the camera's. image1 takes a rig of two
  /// cameras; a rig of two without image1 gives features without range.
  FoundFrame find(const FrameImages& images, const FrameView& view);

 private:
  void extract_primary(const FrameImages& images, const FrameView& view, FoundFrame& found);
  /// Returns how many of them, the last, are points on edges.
  std::size_t extract_keypoints(const FrameImages& images, ImageView mask);
  void add_stereo(const FrameImages& images, const FrameView& view, Features& features);
  StereoSearch& stereo_search(const std::shared_ptr<const Rig>& rig);
  const TangentArrays& compute_tangents(const Camera& camera);
  static void reserve(Features& features, std::size_t count);
  static void append(Features& features,
                     const Keypoint& keypoint,
                     const TangentArrays& tangents,
                     std::size_t i);

  StereoSettings stereo_settings_;
  FeatureExtractor extractor_;
  std::optional<SeamPadding> seam_;  // Where the columns of camera 0 repeat.
  std::optional<StereoSearch> stereo_;
  std::shared_ptr<const Rig> stereo_rig_;  // Of the search.
  TangentComputer tangent_computer_;
  Pyramid pyramid0_;  // Where the extractor's has a wider image.
  Pyramid pyramid1_;
  Image mask_;
  std::vector<Keypoint> keypoints_;
  std::vector<Descriptor> descriptors_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<float> level_scales_;
};

}  // namespace waymark
