// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/copy_on_write_table.h"

#include <gmock/gmock.h>

#include <map>
#include <string>
#include <thread>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

// Small pages and shelves, so that a few elements make many of them.
using Table = CopyOnWriteTable<LandmarkId, std::string, 4, 2>;
using Content = std::map<std::uint32_t, std::string>;

Content content_of(const Table& table) {
  Content content;
  table.for_each([&](LandmarkId id, const std::string& value) { content[id.value] = value; });
  EXPECT_EQ(content.size(), table.size());
  return content;
}

TEST(CopyOnWriteTable, FindsWhatWasInserted) {
  Table table;
  EXPECT_TRUE(table.is_empty());
  const LandmarkId a = table.insert("a");
  const LandmarkId b = table.insert("b");
  EXPECT_LT(a, b);
  EXPECT_EQ(table.at(a), "a");
  EXPECT_EQ(*table.find(b), "b");
  EXPECT_EQ(table.find(LandmarkId{2}), nullptr);
  EXPECT_EQ(table.find(LandmarkId{1000}), nullptr);
  EXPECT_EQ(table.find(LandmarkId{}), nullptr);
  EXPECT_THROW(table.at(LandmarkId{2}), CheckError);
  EXPECT_THROW(table.edit(LandmarkId{2}), CheckError);
}

TEST(CopyOnWriteTable, IdsAreNeverUsedAgain) {
  Table table;
  const LandmarkId a = table.insert("a");
  EXPECT_TRUE(table.erase(a));
  EXPECT_FALSE(table.erase(a));
  EXPECT_EQ(table.end_id(), LandmarkId{1});
  EXPECT_EQ(table.insert("b"), LandmarkId{1});
  EXPECT_EQ(table.find(a), nullptr);
  table.skip_to(LandmarkId{100});
  EXPECT_EQ(table.insert("c"), LandmarkId{100});
  EXPECT_EQ(table.end_id(), LandmarkId{101});
  EXPECT_THROW(table.skip_to(LandmarkId{100}), CheckError);
  EXPECT_EQ(content_of(table), (Content{{1, "b"}, {100, "c"}}));
}

TEST(CopyOnWriteTable, PutsElementsWhereverThereIsNone) {
  Table table;
  table.put(LandmarkId{9}, "i");
  table.put(LandmarkId{8}, "h");
  EXPECT_THROW(table.put(LandmarkId{9}, "again"), CheckError);
  EXPECT_EQ(table.end_id(), LandmarkId{10});
  for (int i = 0; i < 20; ++i) {  // More often than a page has places.
    table.erase(LandmarkId{8});
    table.put(LandmarkId{8}, std::to_string(i));
  }
  EXPECT_EQ(content_of(table), (Content{{8, "19"}, {9, "i"}}));
}

TEST(CopyOnWriteTable, ReferencesLastWhileOthersComeAndGo) {
  Table table;
  for (int i = 0; i < 5; ++i) table.insert(std::to_string(i));
  table.freeze();
  std::string& first = table.edit(LandmarkId{4});
  table.insert("5");
  table.insert("6");
  table.erase(LandmarkId{5});
  table.insert("7");
  first += " edited";
  EXPECT_EQ(table.at(LandmarkId{4}), "4 edited");
  table.freeze();
  EXPECT_EQ(content_of(table).at(4), "4 edited");
}

/// Counts those of its kind that are there.
struct Counted {
  inline static int num_there = 0;
  Counted() { ++num_there; }
  Counted(const Counted&) { ++num_there; }
  Counted(Counted&&) noexcept { ++num_there; }
  Counted& operator=(const Counted&) = default;
  ~Counted() { --num_there; }
};

TEST(CopyOnWriteTable, ItsMemoryFollowsWhatItHoldsAndNotWhatItHeld) {
  CopyOnWriteTable<LandmarkId, Counted> table;
  for (std::uint32_t i = 0; i < 10000; ++i) {
    table.insert({});
    if (i >= 100) table.erase(LandmarkId{i - 100});  // A hundred live at a time.
    if (i % 50 == 0) {
      const auto frozen = table.freeze();
      EXPECT_EQ(Counted::num_there, static_cast<int>(table.size()));
    }
  }
  EXPECT_EQ(table.size(), 100u);
}

TEST(CopyOnWriteTable, FrozenCopiesShareWhatIsNotEdited) {
  Table table;
  for (int i = 0; i < 12; ++i) table.insert(std::to_string(i));
  const Table frozen = table.freeze();
  EXPECT_EQ(frozen.find(LandmarkId{0}), table.find(LandmarkId{0}));
  table.edit(LandmarkId{5}) = "edited";
  EXPECT_EQ(frozen.find(LandmarkId{0}), table.find(LandmarkId{0}));
  EXPECT_NE(frozen.find(LandmarkId{4}), table.find(LandmarkId{4}));
  EXPECT_EQ(frozen.at(LandmarkId{5}), "5");
  // Only the first edit clones the page.
  const std::string* address = table.find(LandmarkId{5});
  table.edit(LandmarkId{6}) = "too";
  EXPECT_EQ(table.find(LandmarkId{5}), address);
}

TEST(CopyOnWriteTable, EditingAFrozenCopyChangesNothingElse) {
  Table table;
  const LandmarkId id = table.insert("old");
  Table copy = table.freeze();
  copy.edit(id) = "copy";
  table.edit(id) = "table";
  EXPECT_EQ(copy.at(id), "copy");
  EXPECT_EQ(table.at(id), "table");
}

TEST(CopyOnWriteTable, ThawingNeedsAFrozenTable) {
  Table table;
  table.insert("a");
  EXPECT_THROW(Table::thaw(table), CheckError);
  const Table frozen = table.freeze();
  Table thawed = Table::thaw(frozen);
  thawed.edit(LandmarkId{0}) = "thawed";
  EXPECT_EQ(thawed.insert("b"), LandmarkId{1});
  EXPECT_EQ(content_of(frozen), (Content{{0, "a"}}));
  EXPECT_EQ(content_of(table), (Content{{0, "a"}}));
}

void edit_randomly(Table& table, Content& model, Rng& rng) {
  const LandmarkId id{rng.below(table.end_id().value + 1)};
  switch (rng.below(4)) {
    case 0: {
      const std::string value = std::to_string(rng.next());
      model[table.insert(value).value] = value;
      break;
    }
    case 1:
      EXPECT_EQ(table.erase(id), model.erase(id.value) == 1);
      break;
    default:
      if (table.contains(id)) model[id.value] = table.edit(id) += "+";
  }
}

// Several live tables descend from each other through frozen copies; each must equal its model, and
// no copy may ever change.
TEST(CopyOnWriteTable, AgreesWithMapsUnderRandomEdits) {
  Rng rng(3, 0);
  std::vector<Table> live(3);
  std::vector<Content> models(3);
  std::vector<Table> frozen;
  std::vector<Content> frozen_models;
  for (int step = 0; step < 6000; ++step) {
    const std::size_t chosen = rng.below(3);
    if (rng.below(20) == 0) {
      frozen.push_back(live[chosen].freeze());
      frozen_models.push_back(models[chosen]);
    } else if (!frozen.empty() && rng.below(50) == 0) {
      const std::size_t source = rng.below(static_cast<std::uint32_t>(frozen.size()));
      live[chosen] = Table::thaw(frozen[source]);
      models[chosen] = frozen_models[source];
    } else {
      edit_randomly(live[chosen], models[chosen], rng);
    }
    ASSERT_EQ(content_of(live[chosen]), models[chosen]) << "after step " << step;
  }
  for (std::size_t i = 0; i < frozen.size(); ++i) {
    ASSERT_EQ(content_of(frozen[i]), frozen_models[i]) << "frozen copy " << i;
  }
}

// For the thread sanitizer: readers read all of a frozen copy while the writer edits on.
TEST(CopyOnWriteTable, ReadersOfFrozenCopiesDoNotMeetTheWriter) {
  CopyOnWriteTable<LandmarkId, std::vector<int>, 8> table;
  for (int i = 0; i < 100; ++i) table.insert({0, 0});
  std::vector<std::jthread> readers;
  std::vector<int> is_consistent(30, 1);
  for (int round = 0; round < 30; ++round) {
    auto frozen =
        std::make_shared<const CopyOnWriteTable<LandmarkId, std::vector<int>, 8>>(table.freeze());
    readers.emplace_back([frozen, round, &is_consistent] {
      frozen->for_each([&](LandmarkId, const std::vector<int>& value) {
        if (value != std::vector<int>{round, round}) is_consistent[round] = 0;
      });
    });
    for (std::uint32_t i = 0; i < 100; ++i) table.edit(LandmarkId{i}).assign(2, round + 1);
  }
  readers.clear();
  EXPECT_THAT(is_consistent, ::testing::Each(1));
}

TEST(CopyOnWriteTable, TellsWhatChangedSince) {
  Table table;
  for (int i = 0; i < 16; ++i) table.insert(std::to_string(i));
  const Table before = table.freeze();
  table.edit(LandmarkId{5}) = "changed";
  table.erase(LandmarkId{6});
  table.insert("new");
  const Table now = table.freeze();
  std::vector<std::uint32_t> visited;
  Content changes;
  now.for_each_difference(before, [&](LandmarkId id, const auto* old, const auto* current) {
    visited.push_back(id.value);
    EXPECT_EQ(old, before.find(id));
    EXPECT_EQ(current, now.find(id));
    if (!old || !current || *old != *current) changes[id.value] = current ? *current : "gone";
  });
  EXPECT_EQ(changes, (Content{{5, "changed"}, {6, "gone"}, {16, "new"}}));
  EXPECT_THAT(visited, ::testing::ElementsAre(4, 5, 6, 7, 16));  // No page that is shared.
}

}  // namespace
}  // namespace waymark
