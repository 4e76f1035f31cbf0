// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/prefetch.h"
#include "waymark/features/frame_builder.h"

namespace waymark {

/// Finds the features of frames before it is their turn, by several threads. A frame is looked at
/// with what is known of the cameras when it is prepared; where that is not what is known when it
/// is its turn, it is looked at again, so that nothing but time depends on it.
class FeaturePrefetch {
 public:
  /// builder: that frames are made with, borrowed. num_threads: they start with the first frame; 0:
  /// nothing is done before its turn.
  FeaturePrefetch(const FrameBuilder& builder, const FrameSettings& settings, unsigned num_threads)
      : builder_(builder), settings_(settings), num_threads_(num_threads) {}

  /// Frames that may be prepared at a time. With two per thread one that takes longer than its
  /// neighbours stops nobody.
  std::size_t capacity() const { return 2 * std::size_t{num_threads_}; }

  /// Begins with a frame that comes after those prepared before; leaves it out where it does not,
  /// or where there is no room. owner keeps the images as long as they are looked at.
  void prepare(const FrameImages& images, std::shared_ptr<const void> owner);

  /// What these images show, if they were prepared: waits for it, and throws what
  /// FeatureFinder::find() threw. Else nothing. Forgets what was prepared for times before.
  std::optional<FoundFrame> take(const FrameImages& images);

 private:
  struct Prepared {
    FrameImages images;
    std::shared_ptr<const void> owner;
    FrameView view;
  };

  void begin(Prepared frame);
  void begin_anew();

  const FrameBuilder& builder_;
  const FrameSettings settings_;
  const unsigned num_threads_;
  std::vector<FeatureFinder> finders_;  ///< One per thread.
  std::deque<Prepared> frames_;
  std::optional<Prefetch<FoundFrame>> work_;  ///< On these frames; last, so that it ends first.
};

}  // namespace waymark
