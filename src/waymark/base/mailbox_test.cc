// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/mailbox.h"

#include <gmock/gmock.h>

#include <array>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "waymark/base/testing/allocation_count.h"

namespace waymark {
namespace {

TEST(Mailbox, KeepsTheOrder) {
  Mailbox<std::unique_ptr<int>> mailbox(3);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(mailbox.push(std::make_unique<int>(i)));
  EXPECT_EQ(mailbox.size(), 3u);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(**mailbox.pop(), i);
  EXPECT_EQ(mailbox.size(), 0u);
}

TEST(Mailbox, DrainsAfterClosing) {
  Mailbox<int> mailbox(2);
  mailbox.push(1);
  mailbox.close();
  EXPECT_FALSE(mailbox.push(2));
  EXPECT_EQ(mailbox.pop(), 1);
  EXPECT_EQ(mailbox.pop(), std::nullopt);
}

TEST(Mailbox, ClosingFreesAWaitingWriterAndReader) {
  Mailbox<int> full(1), empty(1);
  full.push(1);
  bool was_accepted = true;
  std::optional<int> received = 1;
  std::jthread writer([&] { was_accepted = full.push(2); });
  std::jthread reader([&] { received = empty.pop(); });
  full.close();
  empty.close();
  writer.join();
  reader.join();
  EXPECT_FALSE(was_accepted);
  EXPECT_EQ(received, std::nullopt);
}

TEST(Mailbox, NoMessageIsLostOrDoubledBetweenThreads) {
  constexpr int kNumWriters = 3, kNumMessages = 500;
  Mailbox<int> mailbox(4);
  std::vector<std::vector<int>> received(2);
  std::vector<std::jthread> readers, writers;
  for (std::vector<int>& mine : received) {
    readers.emplace_back([&mailbox, &mine] {
      while (const std::optional<int> message = mailbox.pop()) mine.push_back(*message);
    });
  }
  for (int writer = 0; writer < kNumWriters; ++writer) {
    writers.emplace_back([&mailbox, writer] {
      for (int i = 0; i < kNumMessages; ++i) mailbox.push(writer * kNumMessages + i);
    });
  }
  writers.clear();
  mailbox.close();
  readers.clear();
  std::vector<int> all = received[0];
  all.insert(all.end(), received[1].begin(), received[1].end());
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), static_cast<std::size_t>(kNumWriters * kNumMessages));
  for (std::size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i], static_cast<int>(i));
}

// A thread that has run out of memory has to say so.
TEST(Mailbox, TakesNoMemoryForMessages) {
  struct Large {
    std::array<char, 2000> bytes;
  };
  Mailbox<Large> mailbox(3);
  const long before = testing::num_allocations();
  for (int i = 0; i < 10; ++i) {
    mailbox.push({});
    mailbox.push({});
    mailbox.pop();
    mailbox.pop();
  }
  EXPECT_EQ(testing::num_allocations(), before);
}

TEST(Mailbox, NeedsRoom) { EXPECT_THROW(Mailbox<int>(0), CheckError); }

TEST(Mailbox, TriesWithoutWaiting) {
  Mailbox<std::string> mailbox(1);
  EXPECT_FALSE(mailbox.try_pop().has_value());
  std::string first = "first";
  std::string second = "second";
  EXPECT_TRUE(mailbox.try_push(first));
  EXPECT_FALSE(mailbox.try_push(second));
  EXPECT_EQ(second, "second");
  EXPECT_EQ(mailbox.try_pop(), "first");
  mailbox.close();
  EXPECT_FALSE(mailbox.try_push(second));
}

}  // namespace
}  // namespace waymark
