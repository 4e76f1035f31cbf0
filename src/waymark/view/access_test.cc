// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/access.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(Access, FindsQueryParameters) {
  EXPECT_EQ(query_parameter("/ws?token=abc", "token"), "abc");
  EXPECT_EQ(query_parameter("/ws?a=1&token=abc&b=2", "token"), "abc");
  EXPECT_EQ(query_parameter("/ws?xtoken=abc", "token"), "");
  EXPECT_EQ(query_parameter("/ws", "token"), "");
  EXPECT_EQ(query_parameter("/ws?", "token"), "");
  EXPECT_EQ(query_parameter("/ws?&&token=", "token"), "");
}

TEST(Access, LoopbackNeedsItsOwnName) {
  const AccessRules rules;
  EXPECT_TRUE(is_session_allowed(rules, "/ws", "127.0.0.1:8080", ""));
  EXPECT_TRUE(is_session_allowed(rules, "/ws", "localhost:8080", "http://localhost:8080"));
  EXPECT_TRUE(is_session_allowed(rules, "/ws", "[::1]:8080", ""));
  EXPECT_FALSE(is_session_allowed(rules, "/ws", "evil.example:8080", "http://evil.example:8080"));
  EXPECT_FALSE(is_session_allowed(rules, "/ws", "127.0.0.1.evil.example", ""));
  for (const char* host : {"", "[::1].evil.example", "[::1]evil", "[::1", "[::1]:80.evil", ":80"}) {
    EXPECT_FALSE(is_session_allowed(rules, "/ws", host, "")) << host;
  }
}

TEST(Access, ForeignOriginsAreRefused) {
  const AccessRules rules;
  EXPECT_FALSE(is_session_allowed(rules, "/ws", "127.0.0.1:8080", "http://evil.example"));
  EXPECT_FALSE(is_session_allowed(rules, "/ws", "127.0.0.1:8080", "http://127.0.0.1:9090"));
  EXPECT_FALSE(is_session_allowed(rules, "/ws", "127.0.0.1:8080", "null"));
}

TEST(Access, OtherAddressesNeedTheToken) {
  const AccessRules rules{false, make_token()};
  EXPECT_EQ(rules.token.size(), 32u);
  EXPECT_NE(rules.token, make_token());
  const std::string target = "/ws?token=" + rules.token;
  EXPECT_TRUE(is_session_allowed(rules, target, "robot:8080", "http://robot:8080"));
  EXPECT_FALSE(is_session_allowed(rules, "/ws", "robot:8080", ""));
  EXPECT_FALSE(is_session_allowed(rules, "/ws?token=", "robot:8080", ""));
  EXPECT_FALSE(is_session_allowed(rules, target + "0", "robot:8080", ""));
  EXPECT_FALSE(is_session_allowed(rules, target, "robot:8080", "http://evil.example"));
}

}  // namespace
}  // namespace waymark
