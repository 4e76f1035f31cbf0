// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace waymark {

/// The folder of an export, which is there as a whole or not at all: files are made in a folder
/// beside it, which takes its name at the end. An earlier export under that name is replaced; a
/// list in the folder (kListName) says what is an export's. A folder with other files is refused,
/// so that nothing of anybody's is lost and nothing old is taken for a part of the new. Without
/// finish() all stays as it was.
class ExportFolder {
 public:
  static constexpr const char* kListName = "waymark_export.txt";

  /// Throws InputError for a folder with files that are no export's, OutputError where no folder
  /// can be made.
  explicit ExportFolder(const std::filesystem::path& folder);
  ~ExportFolder();
  ExportFolder(const ExportFolder&) = delete;
  ExportFolder& operator=(const ExportFolder&) = delete;

  /// Whether an earlier export is there.
  bool is_again() const { return is_again_; }
  /// Where the files are to be made.
  const std::filesystem::path& unfinished() const { return unfinished_; }
  /// Once, after the last file is made. Throws like the constructor: what was there may have
  /// changed meanwhile.
  void finish();

 private:
  const std::filesystem::path folder_;
  const std::filesystem::path unfinished_;
  bool is_again_ = false;
};

}  // namespace waymark
