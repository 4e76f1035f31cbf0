// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/connection_pool.h"

#include <gtest/gtest.h>

#include <string>

namespace waymark {
namespace {

/// Three places; whoever is closed leaves its name.
class Pool : public ::testing::Test {
 protected:
  std::uint64_t add(const std::string& address, const std::string& name) {
    return pool_.add(boost::asio::ip::make_address(address), [this, name] { closed_ += name; });
  }

  ConnectionPool pool_{3};
  std::string closed_;
};

TEST_F(Pool, TheOldestMakesRoom) {
  add("10.0.0.1", "a");
  add("10.0.0.1", "b");
  add("10.0.0.1", "c");
  EXPECT_EQ(closed_, "");
  add("10.0.0.1", "d");
  EXPECT_EQ(closed_, "a");
  add("10.0.0.2", "e");
  EXPECT_EQ(closed_, "ab");
}

TEST_F(Pool, AnAddressWithManyDoesNotPushOutOthers) {
  add("10.0.0.1", "a");
  add("10.0.0.2", "b");
  for (int i = 0; i < 5; ++i) add("10.0.0.2", "c");
  EXPECT_EQ(closed_, "bccc");
}

TEST_F(Pool, WhoAsksBecomesTheNewest) {
  const std::uint64_t first = add("10.0.0.1", "a");
  add("10.0.0.1", "b");
  add("10.0.0.1", "c");
  pool_.renew(first);
  add("10.0.0.1", "d");
  EXPECT_EQ(closed_, "b");
}

TEST_F(Pool, WhoLeavesMakesRoom) {
  const std::uint64_t first = add("10.0.0.1", "a");
  add("10.0.0.1", "b");
  add("10.0.0.1", "c");
  pool_.remove(first);
  pool_.remove(first);
  add("10.0.0.1", "d");
  EXPECT_EQ(closed_, "");
  pool_.renew(first);
  add("10.0.0.1", "e");
  EXPECT_EQ(closed_, "b");
}

}  // namespace
}  // namespace waymark
