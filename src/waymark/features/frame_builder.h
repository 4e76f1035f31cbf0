// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/features/depth.h"
#include "waymark/features/feature_finder.h"
#include "waymark/features/features.h"
#include "waymark/features/view_mask.h"
#include "waymark/image/image.h"

namespace waymark {

/// Turns the images of a sequence into the immutable data of its frames: finds features, depths and
/// what moves along with the camera. Keeps its buffers; what is new per frame is the result. The
/// same images give the same frame once the surroundings of the image circle are known
/// (ViewMask::learn), until watch() finds something.
class FrameBuilder {
 public:
  /// Throws InputError for a word that view.auto_mask does not know.
  FrameBuilder(std::shared_ptr<const Rig> rig, const FrameSettings& settings);
  FrameBuilder(Rig rig, const FrameSettings& settings)
      : FrameBuilder(std::make_shared<const Rig>(std::move(rig)), settings) {}

  /// Throws InputError where the size of an image is not the camera's. image1 takes a rig of two
  /// cameras; a rig of two without image1 gives features without range.
  ///
  /// motion: as far as it is known beforehand; features of rolling shutters are corrected by it,
  /// and found in depth images of other times.
  std::shared_ptr<const Features> build(const FrameImages& images, const RigMotion& motion = {});

  /// The same of images in which features were found beforehand, in the view() of now.
  std::shared_ptr<const Features> build(FoundFrame found,
                                        const FrameImages& images,
                                        const RigMotion& motion);

  /// With what the next frame is looked at.
  FrameView view() const;
  /// Whether the next images may change that before they are looked at.
  bool is_learning() const;

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

  /// The cameras as calibrated by now.
  const std::shared_ptr<const Rig>& rig() const { return rig_; }
  /// From now on the images are of the same cameras calibrated otherwise.
  void set_calibration(std::shared_ptr<const Rig> rig);

 private:
  void add_depth(const FrameImages& images, const RigMotion& motion, Features& features);

  std::shared_ptr<const Rig> rig_;
  DepthSettings depth_;
  bool is_auto_masked_;
  FeatureFinder finder_;
  std::vector<ViewMask> view_masks_;  // Per camera of the rig.
  std::vector<Keypoint> keypoints_;
  std::shared_ptr<const SmallImage> small_image_;
  FrameTimes times_;
};

}  // namespace waymark
