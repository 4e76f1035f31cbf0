// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/keyframe_image_cache.h"

#include <gtest/gtest.h>

#include "waymark/map/testing/random_map.h"
#include "waymark/session/testing/memory_input.h"

namespace waymark {
namespace {

using testing::small_frames;

/// A map with a keyframe of each of these times.
std::shared_ptr<const Map> map_of(const std::vector<std::int64_t>& times_ns) {
  static testing::RandomMap random(1, 10);
  const Keyframe* first = nullptr;
  random.map().keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (!first) first = &keyframe;
  });
  Map map;
  const SubmapId submap = map.add_submap(true);
  for (const std::int64_t time_ns : times_ns) {
    Keyframe keyframe = *first;
    keyframe.timestamp_ns = time_ns;
    keyframe.submap = submap;
    keyframe.parent = map.submaps()[0].root;
    map.add_keyframe(std::move(keyframe));
  }
  return map.freeze();
}

SharedJpeg jpeg(const char* content) { return std::make_shared<const std::string>(content); }

TEST(KeyframeImageCache, KeepsTheImagesOfKeyframesAndOfYoungFrames) {
  std::shared_ptr<const Map> map = map_of({});
  KeyframeImageCache keeper([&] { return map; }, {});
  map = map_of({300'000'000, 39'800'000'000});  // Frames 3 and 398.
  for (InputFrame& frame : small_frames(400)) {
    keeper.add(frame);
    EXPECT_TRUE(frame.jpeg.empty());
  }

  const KeyframeImages images = keeper.images_of(*map);
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(*images.at(KeyframeId{0}), "300000000");
  EXPECT_EQ(*images.at(KeyframeId{1}), "39800000000");
  // Frame 4 was none for so long that its image went; 350 may still become one.
  const KeyframeImages others = keeper.images_of(*map_of({400'000'000, 35'000'000'000}));
  ASSERT_EQ(others.size(), 1u);
  EXPECT_EQ(*others.at(KeyframeId{1}), "35000000000");
}

TEST(KeyframeImageCache, TellsEarlierSessionsByTheirKeyframes) {
  // Times of sessions may well be the same.
  const std::shared_ptr<const Map> before = map_of({0, 100'000'000});
  KeyframeImageCache keeper([&] { return before; }, {{KeyframeId{1}, jpeg("earlier")}});
  for (InputFrame& frame : small_frames(3)) keeper.add(frame);
  const std::shared_ptr<const Map> after = map_of({0, 100'000'000, 200'000'000});
  const KeyframeImages images = keeper.images_of(*after);
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(*images.at(KeyframeId{1}), "earlier");
  EXPECT_EQ(*images.at(KeyframeId{2}), "200000000");

  keeper.begin_anew();
  const KeyframeImages own = keeper.images_of(*after);
  ASSERT_EQ(own.size(), 3u);
  EXPECT_EQ(*own.at(KeyframeId{1}), "100000000");
}

}  // namespace
}  // namespace waymark
