// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/autosave.h"

#include <gmock/gmock.h>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/map/testing/random_map.h"

namespace waymark {
namespace {

constexpr double kAtOnce = 1e-9;
constexpr double kNeverAgain = 1e6;

std::shared_ptr<const Map> some_map(std::uint64_t seed) {
  return testing::RandomMap(seed, 60).map().freeze();
}

std::size_t num_saved_keyframes(const std::filesystem::path& path) {
  return load_map(path).map->keyframes().size();
}

class AutosaveTest : public ::testing::Test {
 protected:
  Autosave make(double interval_s) { return Autosave(path_, interval_s, "seed: 7\n", images_); }

  testing::TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "maps" / "map.wmap";
  KeyframeImageCache images_{[] { return Map().freeze(); }, {}};
  const std::shared_ptr<const Map> first_ = some_map(1);
  const std::shared_ptr<const Map> second_ = some_map(2);

  void SetUp() override {
    std::filesystem::create_directories(path_.parent_path());
    ASSERT_NE(first_->keyframes().size(), second_->keyframes().size());
  }
};

TEST_F(AutosaveTest, SavesWholeMapsWhenItIsTime) {
  { EXPECT_EQ(make(kAtOnce).update(first_), std::nullopt); }
  const StoredMap stored = load_map(path_);
  EXPECT_EQ(stored.map->keyframes().size(), first_->keyframes().size());
  EXPECT_EQ(stored.settings, "seed: 7\n");
  // Nothing of the way it was written is left.
  const auto files = std::filesystem::directory_iterator(path_.parent_path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST_F(AutosaveTest, WaitsForItsTimeAndForAMap) {
  { EXPECT_EQ(make(0.0).update(first_), std::nullopt); }
  { EXPECT_EQ(make(kNeverAgain).update(first_), std::nullopt); }
  { EXPECT_EQ(make(kAtOnce).update(Map().freeze()), std::nullopt); }
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(AutosaveTest, LeavesTheLastState) {
  Autosave autosave = make(kAtOnce);
  autosave.update(first_);
  autosave.save(second_);
  EXPECT_EQ(num_saved_keyframes(path_), second_->keyframes().size());
}

TEST_F(AutosaveTest, TellsWhatWentWrongAndTriesAgain) {
  std::filesystem::remove(path_.parent_path());
  Autosave autosave = make(kAtOnce);
  EXPECT_EQ(autosave.update(first_), std::nullopt);
  std::optional<std::string> failure;
  while (!failure) failure = autosave.update(first_);
  EXPECT_THAT(*failure, ::testing::HasSubstr("map.wmap"));
  EXPECT_THROW(autosave.save(first_), OutputError);

  std::filesystem::create_directories(path_.parent_path());
  while (!std::filesystem::exists(path_)) autosave.update(first_);
}

TEST_F(AutosaveTest, SavesSoonWhenAsked) {
  Autosave autosave = make(0.0);
  std::vector<std::string> answers;
  autosave.save_soon([&](const std::string& error) { answers.push_back(error); });
  while (answers.empty()) autosave.update(first_);
  EXPECT_THAT(answers, ::testing::ElementsAre(""));
  EXPECT_EQ(num_saved_keyframes(path_), first_->keyframes().size());
  // A wish that no update() met is met by the end.
  autosave.save_soon([&](const std::string& error) { answers.push_back(error); });
  autosave.save(second_);
  EXPECT_THAT(answers, ::testing::ElementsAre("", ""));
  EXPECT_EQ(num_saved_keyframes(path_), second_->keyframes().size());

  std::filesystem::remove_all(path_.parent_path());
  autosave.save_soon([&](const std::string& error) { answers.push_back(error); });
  while (answers.size() < 3) autosave.update(first_);
  EXPECT_THAT(answers.back(), ::testing::HasSubstr("map.wmap"));
}

}  // namespace
}  // namespace waymark
