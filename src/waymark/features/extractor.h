// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "waymark/features/features.h"
#include "waymark/features/pyramid.h"
#include "waymark/features/settings.h"
#include "waymark/image/image.h"

namespace waymark {

/// Finds features: FAST corners (Rosten & Drummond 2006) on the levels of a pyramid, spread evenly
/// over the image (Bailo et al. 2018), located to sub-pixel accuracy, oriented and described by
/// rotated BRIEF (Rublee et al. 2011). Same image, same bits; nothing is carried over from one
/// image to the next but buffers, so that nothing is allocated after the first image of a size.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(const FeatureSettings& settings);
  ~FeatureExtractor();
  FeatureExtractor(FeatureExtractor&&) noexcept;
  FeatureExtractor& operator=(FeatureExtractor&&) noexcept;

  /// Replaces the contents of keypoints and descriptors, which run in parallel, by the features of
  /// the image, ordered by level, row and column. There are settings.count of them, fewer only
  /// where the image has no more corners. The mask is empty or of the size of the image; there are
  /// no features of a level where it is not above the number of the level, none at all where it is
  /// 0. Where corners of good contrast are few, points on edges follow (EdgeFinder), whose angle is
  /// that across the edge; returns how many. Throws InputError where the sizes differ.
  std::size_t extract(ImageView image,
                      ImageView mask,
                      std::vector<Keypoint>& keypoints,
                      std::vector<Descriptor>& descriptors);

  /// Levels of the last image.
  const Pyramid& pyramid() const;

 private:
  struct Workspace;
  FeatureSettings settings_;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace waymark
