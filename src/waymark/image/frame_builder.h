// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/camera/tangent.h"
#include "waymark/image/depth.h"
#include "waymark/image/extractor.h"
#include "waymark/image/features.h"
#include "waymark/image/image.h"
#include "waymark/image/pyramid.h"
#include "waymark/image/stereo.h"
#include "waymark/image/view_mask.h"

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

/// What the stages of the last frame took.
struct FrameTimes {
  double features_ms = 0.0;  ///< Extraction and bearings of camera 0.
  double depth_ms = 0.0;     ///< Stereo search with the pyramid of camera 1, or the depth image.
};

/// Takes the seam out of 360 degree images: repeats columns at both sides, so that what lies across
/// the seam is found and described like everything else. Keeps its buffers.
class SeamPadding {
 public:
  /// margin_px: columns at either side, at most the width.
  explicit SeamPadding(int margin_px) : margin_px_(margin_px) {}

  int margin_px() const { return margin_px_; }

  /// The image, margin_px wider at both sides. Stays valid until the next call.
  ImageView widen(ImageView image);

  /// The mask of the widened image: 0 in the margins, where everything is seen a second time. An
  /// empty mask is one of `otherwise` all over an image of this size.
  ImageView widen_mask(ImageView mask, int width_px, int height_px, std::uint8_t otherwise);

 private:
  int margin_px_;
  Image image_;
  Image mask_;
};

/// Turns images into the immutable data of a frame: extraction, tangents, stereo or depth. Keeps
/// its buffers; what is new per frame is the result. The same images give the same frame once the
/// surroundings of the image circle are known (ViewMask::learn), until watch() finds something.
class FrameBuilder {
 public:
  /// Throws InputError for a word that view.auto_mask does not know.
  FrameBuilder(Rig rig, const FrameSettings& settings);

  /// Throws InputError where the size of an image is not the camera's. image1 takes a rig of two
  /// cameras; a rig of two without image1 gives features without range.
  ///
  /// motion: as far as it is known beforehand; features of rolling shutters are corrected by it,
  /// and found in depth images of other times.
  std::shared_ptr<const Features> build(const FrameImages& images, const RigMotion& motion = {});

  /// Looks for what moves along with camera 0. From the next image on it is kept free of features.
  /// is_same_world: whether the landmarks and directions are in the same world as those before.
  void watch(const LocatedImage& located, bool is_same_world);

  /// What was found: 0 where camera 0 shows what moves along with it, else 255; empty: nowhere.
  const Image& ego_mask() const { return view_masks_[0].ego_mask(); }

  /// Image 0 of the last frame; null before the first.
  std::shared_ptr<const SmallImage> small_image() const { return small_image_; }

  /// Whether features depend on the motion: of rolling shutters, or in depth images of other times.
  bool needs_motion(const FrameImages& images) const;

  const FrameTimes& times() const { return times_; }

  /// From now on the images are of the same cameras calibrated otherwise.
  void look_with(const Rig& rig);

 private:
  void extract_primary(const FrameImages& images, Features& features);
  /// Returns how many of them, the last, are points on edges.
  std::size_t extract_keypoints(const FrameImages& images);
  void add_stereo(const FrameImages& images, Features& features);
  void add_depth(const FrameImages& images, const RigMotion& motion, Features& features);
  const TangentArrays& compute_tangents(const Camera& camera);
  static void reserve(Features& features, std::size_t count);
  static void append(Features& features,
                     const Keypoint& keypoint,
                     const TangentArrays& tangents,
                     std::size_t i);

  Rig rig_;
  FrameSettings settings_;
  bool is_auto_masked_;
  FeatureExtractor extractor_;
  std::vector<ViewMask> view_masks_;  // Per camera of the rig.
  std::optional<SeamPadding> seam_;   // Where the columns of camera 0 repeat.
  std::optional<StereoSearch> stereo_;
  TangentComputer tangent_computer_;
  Pyramid pyramid0_;  // Where the extractor's has a wider image.
  Pyramid pyramid1_;
  std::vector<Keypoint> keypoints_;
  std::vector<Descriptor> descriptors_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<float> level_scales_;
  std::shared_ptr<const SmallImage> small_image_;
  FrameTimes times_;
};

}  // namespace waymark
