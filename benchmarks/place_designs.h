// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "waymark/image/features.h"

namespace waymark {

/// A way to find keyframes that look alike.
class PlaceDesign {
 public:
  virtual ~PlaceDesign() = default;
  virtual void add(std::span<const Descriptor> descriptors) = 0;
  /// To be called when the last keyframe was added, before the first find().
  virtual void finish() {}
  /// The numbers of the best keyframes, best first, none of them in [begin, end).
  virtual std::vector<std::size_t> find(std::span<const Descriptor> descriptors,
                                        std::size_t count,
                                        std::size_t begin,
                                        std::size_t end) const = 0;
};

/// The index of the library.
std::unique_ptr<PlaceDesign> make_place_index();

/// Bags of binary words: a vocabulary tree over the descriptors of the map (Nister and Stewenius
/// 2006), its nodes the bitwise majority of theirs, and an inverted file that scores by the L1
/// distance of vectors of tf-idf weights. The tree is trained on the first keyframes.
std::unique_ptr<PlaceDesign> make_vocabulary_tree(std::size_t num_training);

/// Compares with every descriptor of every keyframe: what no faster design can surpass by much.
std::unique_ptr<PlaceDesign> make_exhaustive_search();

}  // namespace waymark
