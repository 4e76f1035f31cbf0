// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_folder.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
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

TEST(ExportFolder, ReplacesAnEarlierExportAndNothingElse) {
  const TemporaryFolder folder;
  const auto out = folder / "out";
  export_files(out, {"images/1.jpg", "images/2.jpg", "masks/2.png", "sparse/1/cameras.bin"}, "a");
  folder.write("out/images/mine.jpg", "mine");
  folder.write("out/notes.txt", "mine");
  export_files(out, {"images/1.jpg", "images/3.jpg"}, "b");
  EXPECT_THAT(all_below(out),
              ElementsAre("images",
                          "images/1.jpg",
                          "images/3.jpg",
                          "images/mine.jpg",
                          "notes.txt",
                          ExportFolder::kListName));
  EXPECT_EQ(read_text_file(out / "images/1.jpg", "a file"), "b");
  EXPECT_EQ(read_text_file(out / "images/mine.jpg", "a file"), "mine");
}

TEST(ExportFolder, LeavesAllAsItWasWithoutAnEnd) {
  const TemporaryFolder folder;
  {
    const ExportFolder unfinished(folder / "new");
    folder.write("new/.waymark_export.partial/images/1.jpg", "b");
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "new"));
  export_files(folder / "out", {"1.jpg"}, "a");
  folder.write("out/.waymark_export.partial/2.jpg", "of a program that was killed");
  { const ExportFolder unfinished(folder / "out"); }
  EXPECT_THAT(all_below(folder / "out"), ElementsAre("1.jpg", ExportFolder::kListName));
}

TEST(ExportFolder, RemovesNothingOutsideWhateverTheListSays) {
  const TemporaryFolder folder;
  folder.write("mine.txt", "mine");
  folder.write("out/below/kept.txt", "mine");
  folder.write(std::string("out/") + ExportFolder::kListName,
               "../mine.txt\nx/../../mine.txt\n" + (folder / "mine.txt").string() +
                   "\n\nbelow\nnone/there\n");
  export_files(folder / "out", {"1.jpg"}, "a");
  EXPECT_TRUE(std::filesystem::exists(folder / "mine.txt"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out/below/kept.txt"));
}

TEST(ExportFolder, SaysWhatIsInTheWay) {
  const TemporaryFolder folder;
  folder.write("file", "");
  EXPECT_THROW(ExportFolder(folder / "file"), OutputError);
  folder.write("out/1.jpg/a", "");
  EXPECT_THROW(export_files(folder / "out", {"1.jpg"}, "a"), OutputError);
}

}  // namespace
}  // namespace waymark
