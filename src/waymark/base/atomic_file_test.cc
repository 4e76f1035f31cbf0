// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/atomic_file.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::size_t num_entries(const TemporaryFolder& folder) {
  const std::filesystem::directory_iterator entries(folder.path());
  return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
}

TEST(AtomicFile, AppearsWithCommitOnly) {
  const TemporaryFolder folder;
  {
    AtomicFile file(folder / "a.txt");
    file.write("half");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  }
  EXPECT_EQ(num_entries(folder), 0u);
  AtomicFile file(folder / "a.txt");
  const std::string large(3'000'000, 'x');  // Larger than the buffer.
  file.write(large);
  file.write("end");
  file.commit();
  EXPECT_EQ(read_text_file(folder / "a.txt", "text"), large + "end");
  EXPECT_EQ(num_entries(folder), 1u);
}

TEST(AtomicFile, ReplacesButKeepsTheOldOneUntilThen) {
  const TemporaryFolder folder;
  folder.write("a.txt", "old");
  {
    AtomicFile file(folder / "a.txt");
    file.write("new");
    EXPECT_EQ(read_text_file(folder / "a.txt", "text"), "old");
    file.commit();
  }
  EXPECT_EQ(read_text_file(folder / "a.txt", "text"), "new");
}

TEST(SaveEach, GoesOnAfterAFailureAndTellsAll) {
  int num_calls = 0;
  const auto good = [&] { ++num_calls; };
  const auto bad = [&] {
    ++num_calls;
    throw OutputError("disk", "is full");
  };
  const auto short_of_memory = [&] {
    ++num_calls;
    throw std::bad_alloc();
  };
  save_each({good, good});
  EXPECT_THROW(save_each({short_of_memory, good}), std::bad_alloc);
  EXPECT_THAT(
      [&] {
        save_each({bad, good, short_of_memory});
      },
      ::testing::Throws<OutputError>(::testing::Property(
          &OutputError::what, ::testing::StrEq("disk: is full; waymark: out of memory"))));
  EXPECT_EQ(num_calls, 7);
}

TEST(AtomicFile, WritesThroughLinks) {
  const TemporaryFolder folder;
  folder.write("target.txt", "old");
  std::filesystem::create_symlink("target.txt", folder / "link.txt");
  write_file_atomically(folder / "link.txt", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.txt"));
  EXPECT_EQ(read_text_file(folder / "target.txt", "text"), "new");
}

TEST(AtomicFile, SaysWhyItCannotBeMade) {
  const TemporaryFolder folder;
  EXPECT_THROW(AtomicFile(folder / "none" / "a.txt"), OutputError);
  EXPECT_THROW(AtomicFile(folder.path()), OutputError);
  EXPECT_THROW(AtomicFile("/dev/null"), OutputError);
  try {
    AtomicFile file(folder / "none" / "a.txt");
  } catch (const OutputError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("a.txt: cannot be made: No such file or directory, expected"));
  }
}

TEST(MakeOutputFolder, MakesAllOfItOrSaysWhatIsInTheWay) {
  const TemporaryFolder folder;
  make_output_folder(folder / "a" / "b");
  make_output_folder(folder / "a" / "b");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "a" / "b"));
  folder.write("file", "x");
  EXPECT_THROW(make_output_folder(folder / "file"), OutputError);
  EXPECT_THROW(make_output_folder(folder / "file" / "c"), OutputError);
}

/// Writes beyond the limit in a child process, whose exit status tells what happened.
int write_with_limit(const std::filesystem::path& path) {
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit{100'000, 100'000};
    setrlimit(RLIMIT_FSIZE, &limit);
    signal(SIGXFSZ, SIG_DFL);  // Would kill the process.
    int status = 1;
    try {
      write_file_atomically(path, std::string(5'000'000, 'x'));
    } catch (const OutputError&) {
      status = 0;
    }
    sigset_t pending;
    sigpending(&pending);
    if (sigismember(&pending, SIGXFSZ)) status = 2;
    _exit(status);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

TEST(AtomicFile, LeavesNothingBehindWhenTheFileSizeLimitStrikes) {
  const TemporaryFolder folder;
  EXPECT_EQ(write_with_limit(folder / "a.txt"), 0);
  EXPECT_EQ(num_entries(folder), 0u);
  folder.write("a.txt", "old");
  EXPECT_EQ(write_with_limit(folder / "a.txt"), 0);
  EXPECT_EQ(read_text_file(folder / "a.txt", "text"), "old");
  EXPECT_EQ(num_entries(folder), 1u);
}

TEST(AtomicFile, WhatTheKilledLeftIsRemoved) {
  const TemporaryFolder folder;
  const pid_t killed = fork();
  if (killed == 0) {
    AtomicFile file(folder / "a.txt");
    AtomicFile second(folder / "a.txt");
    AtomicFile other(folder / "b.txt");
    raise(SIGKILL);
  }
  waitpid(killed, nullptr, 0);
  EXPECT_EQ(num_entries(folder), 3u);
  folder.write(".a.txt.partial", "of someone else");
  folder.write(".a.txt.x-0.partial", "of someone else");
  AtomicFile mine(folder / "a.txt");
  remove_abandoned_parts(folder / "a.txt");
  EXPECT_EQ(num_entries(folder), 4u);  // b's, those of someone else, mine.
  mine.write("whole");
  mine.commit();
  EXPECT_EQ(read_text_file(folder / "a.txt", "text"), "whole");
  remove_abandoned_parts(folder / "none" / "a.txt");
}

}  // namespace
}  // namespace waymark
