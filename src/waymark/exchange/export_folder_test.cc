// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_folder.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;

/// An export of files that hold the content each.
void export_files(const std::filesystem::path& folder,
                  const std::vector<std::string>& names,
                  const std::string& content) {
  ExportFolder made(folder);
  for (const std::string& name : names) {
    std::filesystem::create_directories((made.unfinished() / name).parent_path());
    std::ofstream(made.unfinished() / name) << content;
  }
  made.finish();
}

std::vector<std::string> all_below(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    names.push_back(entry.path().lexically_relative(folder).string());
  }
  std::ranges::sort(names);
  return names;
}

TEST(ExportFolder, ReplacesAnEarlierExportAsAWhole) {
  const TemporaryFolder folder;
  const auto out = folder / "out";
  export_files(out, {"images/1.jpg", "images/2.jpg", "masks/2.png", "sparse/1/cameras.bin"}, "a");
  std::filesystem::create_directories(out / "mine");  // An empty folder holds nothing to lose.
  export_files(out, {"images/1.jpg", "images/3.jpg"}, "b");
  EXPECT_THAT(all_below(folder.path()),
              ElementsAre("out",
                          "out/images",
                          "out/images/1.jpg",
                          "out/images/3.jpg",
                          std::string("out/") + ExportFolder::kListName));
  EXPECT_EQ(read_text_file(out / "images/1.jpg", "a file"), "b");
}

TEST(ExportFolder, RefusesAFolderWithOtherFiles) {
  const TemporaryFolder folder;
  export_files(folder / "out", {"images/1.jpg"}, "a");
  folder.write("out/images/mine.jpg", "mine");
  EXPECT_THAT(input_error_of([&] { ExportFolder(folder / "out"); }), HasSubstr("images/mine.jpg"));
  folder.write("other/notes.txt", "mine");
  EXPECT_THAT(input_error_of([&] { ExportFolder(folder / "other"); }), HasSubstr("notes.txt"));
  EXPECT_EQ(read_text_file(folder / "out/images/1.jpg", "a file"), "a");
  // What was put there while the export was being made.
  export_files(folder / "late", {"1.jpg"}, "a");
  ExportFolder late(folder / "late");
  folder.write("late/mine.txt", "mine");
  EXPECT_THROW(late.finish(), InputError);
  EXPECT_EQ(read_text_file(folder / "late/1.jpg", "a file"), "a");
}

TEST(ExportFolder, LeavesAllAsItWasWithoutAnEnd) {
  const TemporaryFolder folder;
  {
    const ExportFolder unfinished(folder / "new");
    std::ofstream(unfinished.unfinished() / "1.jpg") << "b";
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "new"));
  export_files(folder / "out", {"1.jpg"}, "a");
  { const ExportFolder unfinished(folder / "out/"); }
  EXPECT_THAT(all_below(folder.path()),
              ElementsAre("out", "out/1.jpg", std::string("out/") + ExportFolder::kListName));
}

TEST(ExportFolder, GoesWhereALinkLeads) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "disk");
  std::filesystem::create_directory_symlink(folder / "disk", folder / "link");
  export_files(folder / "link", {"1.jpg"}, "a");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_TRUE(std::filesystem::exists(folder / "disk/1.jpg"));
}

TEST(ExportFolder, SaysWhatIsInTheWay) {
  const TemporaryFolder folder;
  folder.write("file", "");
  EXPECT_THROW(ExportFolder(folder / "file"), OutputError);
  EXPECT_THROW(ExportFolder(folder / "file/out"), OutputError);
}

}  // namespace
}  // namespace waymark
