// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/features.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <memory_resource>

namespace waymark {
namespace {

/// Counts what is in use, and knows the last block.
class CountingMemory : public std::pmr::memory_resource {
 public:
  std::size_t num_bytes = 0;
  std::size_t num_blocks = 0;

  bool holds(const void* at) const {
    return at >= block_ && at < static_cast<const std::byte*>(block_) + num_bytes;
  }

 private:
  void* do_allocate(std::size_t size, std::size_t /*alignment*/) override {
    num_bytes += size;
    ++num_blocks;
    return block_ = std::malloc(size);
  }
  void do_deallocate(void* block, std::size_t size, std::size_t /*alignment*/) override {
    num_bytes -= size;
    --num_blocks;
    std::free(block);
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }

  void* block_ = nullptr;
};

// Measured, beyond infinity, unknown; and one of camera 1.
TEST(Features, MeasureInverseRangesOfEitherSign) {
  Features features;
  features.num_primary = 3;
  features.keypoints.resize(4);
  features.bearings.resize(4);
  features.level_pixel_from_bearing.resize(4);
  features.range_m = {4.0f, -50.0f, 0.0f};
  features.inverse_range_sigma = {0.125f, 0.25f, 0.0f};
  EXPECT_EQ(features.measurement(0).inverse_range, 0.25f);
  EXPECT_EQ(features.measurement(0).inverse_range_sigma, 0.125f);
  EXPECT_EQ(features.measurement(1).inverse_range, -0.02f);
  EXPECT_EQ(features.measurement(1).inverse_range_sigma, 0.25f);
  for (const std::uint32_t feature : {2u, 3u}) {
    EXPECT_EQ(features.measurement(feature).inverse_range, 0.0f) << feature;
    EXPECT_EQ(features.measurement(feature).inverse_range_sigma, 0.0f) << feature;
  }
}

Features three_features() {
  Features features;
  features.num_primary = 2;
  features.num_edges = 1;
  features.keypoints = {{.x_px = 3.0f, .y_px = 4.0f}, {.x_px = 40.0f, .level = 2}, {.camera = 1}};
  features.descriptors = {{1, 2, 3, 4}, {5, 6, 7, 8}};
  features.bearings.assign(3, Eigen::Vector3f(0.6f, 0.0f, 0.8f));
  features.level_pixel_from_bearing.assign(3, Matrix23f::Constant(2.0f));
  features.size_rad = {0.1f, 0.2f, 0.3f};
  features.partner = {2, kNoFeature, 0};
  features.range_m = {4.0f, 0.0f};
  features.inverse_range_sigma = {0.125f, 0.0f};
  features.motion.inverse_range = 0.5f;
  features.readout_s = {0.01f, 0.02f};
  features.grid = FeatureGrid(64, 48, 0.0, 2, [&](std::size_t i) {
    return std::pair(features.keypoints[i].x_px, features.keypoints[i].y_px);
  });
  return features;
}

TEST(Features, StoredOnesAreTheSameInOneBlock) {
  const auto memory = std::make_shared<CountingMemory>();
  const Features original = three_features();
  std::shared_ptr<const Features> stored = stored_in(memory, original);
  EXPECT_EQ(memory->num_blocks, 1u);
  EXPECT_EQ(stored->num_primary, 2u);
  EXPECT_EQ(stored->num_edges, 1u);
  EXPECT_EQ(stored->keypoints[1].x_px, 40.0f);
  EXPECT_EQ(stored->descriptors, original.descriptors);
  EXPECT_EQ(stored->bearings, original.bearings);
  EXPECT_EQ(stored->level_pixel_from_bearing, original.level_pixel_from_bearing);
  EXPECT_EQ(stored->size_rad, original.size_rad);
  EXPECT_EQ(stored->partner, original.partner);
  EXPECT_EQ(stored->range_m, original.range_m);
  EXPECT_EQ(stored->inverse_range_sigma, original.inverse_range_sigma);
  EXPECT_EQ(stored->motion, original.motion);
  EXPECT_EQ(stored->readout_s, original.readout_s);
  int num_near = 0;
  stored->grid.visit_near(3.0, 4.0, 5.0, [&](std::uint32_t index) { num_near += index == 0; });
  EXPECT_EQ(num_near, 1);
  EXPECT_TRUE(memory->holds(stored->keypoints.data()));
  EXPECT_TRUE(memory->holds(&stored->inverse_range_sigma.back()));
  stored.reset();
  EXPECT_EQ(memory->num_blocks, 0u);
}

TEST(Features, CopiesOfStoredOnesLieOnTheHeap) {
  const auto memory = std::make_shared<CountingMemory>();
  const std::shared_ptr<const Features> stored = stored_in(memory, three_features());
  const Features copy = *stored;
  EXPECT_EQ(memory->num_blocks, 1u);
  EXPECT_FALSE(memory->holds(copy.keypoints.data()));
}

}  // namespace
}  // namespace waymark
