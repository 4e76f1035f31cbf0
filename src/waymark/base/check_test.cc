// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/check.h"

#include <gmock/gmock.h>

namespace waymark {
namespace {

using ::testing::HasSubstr;

TEST(Check, NamesTheConditionAndThePlace) {
  WAYMARK_CHECK(1 + 1 == 2);
  try {
    WAYMARK_CHECK(1 + 1 == 3);
    FAIL() << "the check did not fail";
  } catch (const CheckError& error) {
    EXPECT_THAT(error.what(), HasSubstr("1 + 1 == 3"));
    EXPECT_THAT(error.what(), HasSubstr("check_test.cc:"));
  }
}

TEST(Check, InputErrorsStartWithThePlace) {
  EXPECT_STREQ(InputError("cam.yaml:3", "no").what(), "cam.yaml:3: no");
}

TEST(Check, ErrorsAreOneLineWhateverTheyQuote) {
  EXPECT_STREQ(InputError("a\nb.yaml:3", "has\r\x1b").what(), "a\\x0ab.yaml:3: has\\x0d\\x1b");
  EXPECT_STREQ(OutputError("a\nb", "full").what(), "a\\x0ab: full");
  EXPECT_STREQ(OutputError("a: b\nc").what(), "a: b\\x0ac");
}

}  // namespace
}  // namespace waymark
