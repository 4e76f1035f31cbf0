// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/sheet.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(SheetTest, ASquareHasTheSizeThatWasAskedFor) {
  const auto pages = marker_sheets(MarkerFamily("tag36h11"), 0.16, std::vector<int>{5});
  ASSERT_EQ(pages.size(), 1u);
  EXPECT_THAT(pages[0], HasSubstr("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""));
  // The border of 8 mm, then a module of 20 mm in white.
  EXPECT_THAT(
      pages[0],
      HasSubstr("<rect x=\"20.0000\" y=\"20.0000\" width=\"160.0000\" height=\"160.0000\"/>"));
  EXPECT_THAT(pages[0], HasSubstr("tag36h11 5, 160.0 mm"));
}

TEST(SheetTest, WhatDoesNotFitGoesToFurtherPages) {
  const std::vector<int> ids = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  const auto pages = marker_sheets(MarkerFamily("tag36h11"), 0.05, ids);
  ASSERT_EQ(pages.size(), 2u);
  EXPECT_THAT(pages[0], HasSubstr("tag36h11 8,"));
  EXPECT_THAT(pages[0], Not(HasSubstr("tag36h11 12,")));
  EXPECT_THAT(pages[1], HasSubstr("tag36h11 12,"));
}

TEST(SheetTest, APdfHasAllPagesAndItsTableSaysWhereItsObjectsBegin) {
  const std::vector<int> ids = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  const std::string file = marker_sheets_pdf(MarkerFamily("tag36h11"), 0.05, ids);
  EXPECT_TRUE(file.starts_with("%PDF-1.4\n"));
  EXPECT_THAT(file, HasSubstr("/Count 2 "));
  // A4 in points; the first square, 8 mm from the left and the top.
  EXPECT_THAT(file, HasSubstr("/MediaBox [0 0 595.2756 841.8898]"));
  EXPECT_THAT(file, HasSubstr("8.0000 239.0000 50.0000 50.0000 re"));
  std::size_t at = file.find("0000000000 65535 f \n") + 20;
  EXPECT_THAT(file, HasSubstr("startxref\n" + std::to_string(file.find("xref\n0 ")) + "\n"));
  for (int number = 1; number <= 7; ++number, at += 20) {
    const std::size_t start = std::stoul(file.substr(at, 10));
    EXPECT_EQ(file.substr(start, 7), std::to_string(number) + " 0 obj");
  }
}

TEST(SheetTest, WhatIsTooLargeIsRefusedWithWhatFits) {
  try {
    marker_sheets(MarkerFamily("tag36h11"), 0.2, std::vector<int>{0});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "--size: is 0.2 m, expected at most 0.168 on paper of 210 x 297 mm");
  }
  EXPECT_THROW(marker_sheets(MarkerFamily("tag36h11"), 0.1, std::vector<int>{587}), InputError);
}

}  // namespace
}  // namespace waymark
