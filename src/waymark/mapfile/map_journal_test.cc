// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_journal.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/map/testing/random_map.h"
#include "waymark/mapfile/testing/map_checksums.h"

namespace waymark {
namespace {

using testing::RandomMap;
using testing::TemporaryFolder;

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class MapJournalTest : public ::testing::Test {
 protected:
  StoredMap freeze(RandomMap& random) {
    StoredMap stored;
    stored.map = random.map().freeze();
    stored.settings = "features: {count: 800}\n";
    stored.images = images_;
    return stored;
  }

  void keep_image_of_newest(const RandomMap& random) {
    KeyframeId newest;
    const_cast<RandomMap&>(random).map().keyframes().for_each(
        [&](KeyframeId id, const Keyframe&) { newest = id; });
    images_[newest] = std::make_shared<const std::string>("\xFF\xD8\0jpeg", 7);
  }

  /// The bytes of a file that holds the same.
  std::string saved(const StoredMap& stored) const {
    save_map(folder_ / "other.wmap", stored);
    return bytes_of(folder_ / "other.wmap");
  }
  std::string reloaded() const { return saved(load_map(path_)); }

  void write(const std::filesystem::path& path, std::string_view bytes) const {
    std::ofstream(path, std::ios::binary) << bytes;
  }

  const TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "map.wmap";
  const std::filesystem::path journal_ = folder_ / "map.wmap.journal";
  KeyframeImages images_;
};

TEST_F(MapJournalTest, BothTogetherAreTheMap) {
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    MapJournal journal(path_, 0);
    RandomMap random(seed, 900);
    images_.clear();
    journal.save(freeze(random));
    ASSERT_FALSE(std::filesystem::exists(journal_));
    const std::string file = bytes_of(path_);
    for (int change = 0; change < 4; ++change) {
      random.go_on(30);
      keep_image_of_newest(random);
      const StoredMap stored = freeze(random);
      journal.save(stored);
      ASSERT_TRUE(std::filesystem::exists(journal_));
      EXPECT_EQ(bytes_of(path_), file);
      EXPECT_EQ(reloaded(), saved(stored)) << "seed " << seed << ", change " << change;
      EXPECT_TRUE(find_map_faults(path_).empty());
    }
  }
}

TEST_F(MapJournalTest, HasOnlyWhatChanged) {
  MapJournal journal(path_, 0);
  RandomMap random(1, 900);
  journal.save(freeze(random));
  const KeyframeId root = random.map().submaps().back().root;
  random.map().move_keyframe(root, Rigid3());
  const StoredMap stored = freeze(random);
  journal.save(stored);
  EXPECT_LT(std::filesystem::file_size(journal_), std::filesystem::file_size(path_) / 50);
  EXPECT_EQ(reloaded(), saved(stored));
}

TEST_F(MapJournalTest, EndsWithTheLastWholeChange) {
  MapJournal journal(path_, 0);
  RandomMap random(2, 300);
  journal.save(freeze(random));
  std::vector<std::string> expected = {reloaded()};
  std::vector<std::size_t> sizes = {0};
  for (int change = 0; change < 3; ++change) {
    random.go_on(5);
    journal.save(freeze(random));
    expected.push_back(reloaded());
    sizes.push_back(std::filesystem::file_size(journal_));
  }
  const std::string bytes = bytes_of(journal_);
  ASSERT_EQ(bytes.size(), sizes.back());
  std::size_t num_whole = 0;
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 60) {
    write(journal_, std::string_view(bytes).substr(0, size));
    while (size >= sizes[num_whole + 1]) ++num_whole;
    EXPECT_EQ(reloaded(), expected[num_whole]) << size << " bytes of " << bytes.size();
  }
  EXPECT_EQ(num_whole, 2u);
}

/// Saves one map after the other in a process of its own, which is killed (SIGKILL) so long after
/// the first save; how many saves it had told of.
std::size_t save_until_killed(const std::filesystem::path& path,
                              const std::vector<StoredMap>& maps,
                              std::chrono::microseconds delay) {
  std::array<int, 2> pipe = {};
  WAYMARK_CHECK(::pipe(pipe.data()) == 0);
  const pid_t child = ::fork();
  if (child == 0) {
    MapJournal journal(path, 0);
    for (const StoredMap& map : maps) {
      journal.save(map);
      if (::write(pipe[1], "s", 1) != 1) break;
    }
    ::_exit(0);
  }
  ::close(pipe[1]);
  std::size_t num_saved = 0;
  char told = 0;
  if (::read(pipe[0], &told, 1) == 1) ++num_saved;
  std::this_thread::sleep_for(delay);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  while (::read(pipe[0], &told, 1) == 1) ++num_saved;
  ::close(pipe[0]);
  return num_saved;
}

TEST_F(MapJournalTest, HoldsTheLastSaveWheneverKilled) {
  constexpr int kNumKills = 20;
  RandomMap random(3, 300);
  std::vector<StoredMap> maps;
  for (int i = 0; i < 200; ++i) {
    maps.push_back(freeze(random));
    random.go_on(5);
  }
  Rng rng(1, 0);
  for (int i = 0; i < kNumKills; ++i) {
    const std::chrono::microseconds delay(rng.below(100'000));
    const std::size_t num_saved = save_until_killed(path_, maps, delay);
    ASSERT_GE(num_saved, 1u);
    // What was under way may have been on the disk already.
    const std::string found = reloaded();
    const bool is_last = found == saved(maps[num_saved - 1]);
    EXPECT_TRUE(is_last || found == saved(maps.at(num_saved))) << num_saved << " saves";
  }
}

TEST_F(MapJournalTest, OfTheFileBeforeCountsForNothing) {
  MapJournal journal(path_, 0);
  RandomMap random(3);
  journal.save(freeze(random));
  random.go_on(3);
  journal.save(freeze(random));
  const std::string changes = bytes_of(journal_);
  ASSERT_FALSE(changes.empty());
  random.go_on(3);
  const StoredMap stored = freeze(random);
  journal.save_whole(stored);
  EXPECT_FALSE(std::filesystem::exists(journal_));
  write(journal_, changes);  // As if the program had been killed before it was removed.
  EXPECT_EQ(reloaded(), saved(stored));
}

TEST_F(MapJournalTest, IsBegunAnewWhenItIsAsLargeAsTheFile) {
  MapJournal journal(path_, 0);
  RandomMap random(4, 100);
  journal.save(freeze(random));
  const std::string file = bytes_of(path_);
  for (int change = 0; bytes_of(path_) == file; ++change) {
    ASSERT_LT(change, 100);
    random.go_on(1);
    journal.save(freeze(random));
  }
  EXPECT_EQ(reloaded(), saved(freeze(random)));
}

TEST_F(MapJournalTest, OfAnotherMapIsNone) {
  MapJournal journal(path_, 0);
  RandomMap first(5, 300), second(6, 300);
  journal.save(freeze(first));
  const StoredMap stored = freeze(second);
  journal.save(stored);
  EXPECT_FALSE(std::filesystem::exists(journal_));
  EXPECT_EQ(reloaded(), saved(stored));
}

TEST_F(MapJournalTest, SmallFilesHaveNone) {
  MapJournal journal(path_);
  RandomMap random(7, 300);
  journal.save(freeze(random));
  random.go_on(5);
  const StoredMap stored = freeze(random);
  journal.save(stored);
  EXPECT_FALSE(std::filesystem::exists(journal_));
  EXPECT_EQ(bytes_of(path_), saved(stored));
}

TEST_F(MapJournalTest, DamageGivesASoundMapOrAnInputError) {
  MapJournal journal(path_, 0);
  RandomMap random(8, 60, 4);
  journal.save(freeze(random));
  random.go_on(10);
  journal.save(freeze(random));
  const std::vector<std::string> records = testing::split_records(bytes_of(journal_));
  Rng rng(0, 0);
  int num_refused = 0;
  for (int attempt = 0; attempt < 150; ++attempt) {
    auto damaged = records;
    std::string& record = damaged[rng.below(static_cast<std::uint32_t>(damaged.size()))];
    record[rng.below(static_cast<std::uint32_t>(record.size()))] =
        static_cast<char>(rng.below(256));
    testing::seal_record(record);
    write(journal_, testing::join_records(damaged));
    try {
      EXPECT_EQ(load_map(path_).map->broken_invariants(), "");
    } catch (const InputError&) {
      ++num_refused;
    }
  }
  EXPECT_GT(num_refused, 25);
}

}  // namespace
}  // namespace waymark
