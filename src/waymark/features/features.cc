// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/features.h"

#include <utility>

namespace waymark {
namespace {

/// Room for the arrays of features, wherever each begins.
std::size_t bytes_of(const Features& features) {
  constexpr std::size_t kNumArrays = 10;
  std::size_t sum = kNumArrays * alignof(std::max_align_t) + features.grid.num_bytes();
  const auto add = [&sum](const auto&... arrays) {
    ((sum += arrays.size() * sizeof(arrays[0])), ...);
  };
  add(features.keypoints,
      features.descriptors,
      features.bearings,
      features.level_pixel_from_bearing,
      features.size_rad,
      features.partner,
      features.range_m,
      features.inverse_range_sigma);
  return sum;
}

Features copy(const Features& features, std::pmr::memory_resource* memory) {
  return {.rig = features.rig,
          .num_primary = features.num_primary,
          .num_edges = features.num_edges,
          .keypoints = {features.keypoints, memory},
          .descriptors = {features.descriptors, memory},
          .bearings = {features.bearings, memory},
          .level_pixel_from_bearing = {features.level_pixel_from_bearing, memory},
          .size_rad = {features.size_rad, memory},
          .partner = {features.partner, memory},
          .range_m = {features.range_m, memory},
          .inverse_range_sigma = {features.inverse_range_sigma, memory},
          .inverse_depth_offset = features.inverse_depth_offset,
          .motion = features.motion,
          .readout_s = features.readout_s,
          .grid = {features.grid, memory}};
}

struct Block {
  Block(std::shared_ptr<std::pmr::memory_resource> of, std::size_t num_bytes)
      : memory(std::move(of)), size(num_bytes), data(memory->allocate(size)) {}
  ~Block() { memory->deallocate(data, size); }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  std::shared_ptr<std::pmr::memory_resource> memory;
  std::size_t size;
  void* data;
};

/// Features and the block that they lie in.
struct StoredFeatures {
  StoredFeatures(std::shared_ptr<std::pmr::memory_resource> memory, const Features& original)
      : block(std::move(memory), bytes_of(original)),
        arrays(block.data, block.size, std::pmr::null_memory_resource()),
        features(copy(original, &arrays)) {}

  Block block;
  std::pmr::monotonic_buffer_resource arrays;
  Features features;
};

}  // namespace

std::shared_ptr<const Features> stored_in(std::shared_ptr<std::pmr::memory_resource> memory,
                                          const Features& features) {
  const auto stored = std::make_shared<const StoredFeatures>(std::move(memory), features);
  return {stored, &stored->features};
}

}  // namespace waymark
