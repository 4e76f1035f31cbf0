// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/documentation.h"

#include <gtest/gtest.h>

#include <fstream>

namespace waymark {
namespace {

TEST(Documentation, IsNamedWhereItIs) {
  const std::filesystem::path prefix = std::filesystem::path(::testing::TempDir()) / "installed#1";
  const std::filesystem::path program = prefix / "bin" / "waymark";
  const std::filesystem::path docs = prefix / "share" / "doc" / "waymark" / "docs";
  const std::string page = "docs/results.md#a-heading";
  EXPECT_EQ(documentation(page, program), page) << "where nothing is installed";
  std::filesystem::create_directories(docs);
  std::ofstream(docs / "results.md") << "# Results\n";
  EXPECT_EQ(documentation(page, program), (docs / "results.md").string() + "#a-heading");
  EXPECT_EQ(documentation("docs/results.md", program), (docs / "results.md").string());
  EXPECT_EQ(documentation("docs/gone.md", program), "docs/gone.md");
  EXPECT_EQ(documentation("docs/results.md", {}), "docs/results.md");
  std::filesystem::remove_all(prefix);
}

TEST(Documentation, IsThatOfTheSourcesForWhatIsBuilt) {
  EXPECT_EQ(documentation("docs/results.md#x"), "docs/results.md#x");
}

}  // namespace
}  // namespace waymark
