// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/append_file.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

class AppendFileTest : public ::testing::Test {
 protected:
  std::string content() const { return read_text_file(path_, "text"); }

  const TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "a.log";
};

TEST_F(AppendFileTest, GrowsByWholeParts) {
  folder_.write("a.log", "what was there");
  const std::string large(200'000, 'x');  // Larger than the buffer.
  {
    AppendFile file(path_);
    EXPECT_EQ(content(), "");
    file.write("one ");
    file.commit();
    EXPECT_EQ(content(), "one ");
    file.write(large);
    file.commit();
    EXPECT_EQ(file.size(), 4 + large.size());
    file.write(large);
    file.write("never");
  }
  EXPECT_EQ(content(), "one " + large);
}

TEST_F(AppendFileTest, GoesOnBehindWhatWasTakenBack) {
  AppendFile file(path_);
  file.write("one ");
  file.commit();
  file.write(std::string(200'000, 'x'));
  file.take_back();
  file.write("two");
  file.commit();
  EXPECT_EQ(content(), "one two");
}

TEST_F(AppendFileTest, TakesBackWhatHadNoRoom) {
  AppendFile file(path_);
  file.write("one ");
  file.commit();
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{100'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string failure;
  try {
    file.write(std::string(300'000, 'x'));
    file.commit();
  } catch (const OutputError& error) {
    failure = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_THAT(failure, HasSubstr("a.log: cannot be written"));
  EXPECT_EQ(content(), "one ");
}

TEST_F(AppendFileTest, NeedsAFolder) {
  EXPECT_THROW(AppendFile(folder_ / "none" / "a.log"), OutputError);
}

}  // namespace
}  // namespace waymark
