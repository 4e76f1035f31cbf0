// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/features/features.h"
#include "waymark/features/frame_builder.h"
#include "waymark/image/image.h"

namespace waymark {

/// Looks at the first images of a stereo pair: whether what camera 0 sees is in camera 1 where the
/// calibration says, and if not, which usual mistake would explain where it is.
class PairCheck {
 public:
  /// rig: two cameras.
  PairCheck(Rig rig, FrameSettings settings);

  /// features: what was made of the images with the rig.
  void add(const FrameImages& images, const Features& features);
  int num_images() const { return num_images_; }

  /// In words: what is wrong.
  std::optional<std::string> advise() const;

 private:
  /// Features of camera 0, those found in camera 1, and those of them with a distance.
  struct Counts {
    std::size_t features = 0;
    std::size_t partners = 0;
    std::size_t ranges = 0;

    void add(const Features& found);
    double partners_share() const;
    double ranges_share() const;
  };
  /// Another way to take the same images.
  struct Trial {
    Rig rig;
    bool swaps_images;
    Counts counts = {};
  };

  Rig rig_;
  FrameSettings settings_;
  int num_images_ = 0;
  Counts given_;
  Trial swapped_;
  Trial inverse_;
  Trial negated_;
};

}  // namespace waymark
