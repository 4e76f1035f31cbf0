// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/scratch_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;

TEST(ScratchFolder, GoesWithItsObject) {
  const TemporaryFolder folder;
  std::optional<ScratchFolder> scratch;
  scratch.emplace(folder / "new-");
  const fs::path path = scratch->path();
  EXPECT_TRUE(path.filename().string().starts_with("new-"));
  std::ofstream(path / "file") << "x";
  scratch.reset();
  EXPECT_FALSE(fs::exists(path));
  EXPECT_THROW(ScratchFolder(folder / "none" / "new-"), OutputError);
}

TEST(ScratchFolder, OnlyThatOfTheKilledIsRemoved) {
  const TemporaryFolder folder;
  const pid_t killed = fork();
  if (killed == 0) {
    const ScratchFolder left(folder / "new-");
    std::ofstream(left.path() / "file") << "x";
    raise(SIGKILL);
  }
  waitpid(killed, nullptr, 0);
  EXPECT_FALSE(fs::is_empty(folder / ""));
  folder.write("new-file", "as older programs left");
  folder.write("other", "of someone else");
  const ScratchFolder mine(folder / "new-");
  remove_abandoned_scratch(folder / "new-");
  int count = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "")) {
    ++count;
    EXPECT_TRUE(entry.path() == mine.path() || entry.path().filename() == "other") << entry.path();
  }
  EXPECT_EQ(count, 2);
  remove_abandoned_scratch(folder / "none" / "new-");
}

}  // namespace
}  // namespace waymark
