// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace waymark {

/// The folder of an export, which may hold an earlier one. Files are made in a folder of their own
/// inside it and moved to their places by finish(), which removes what the earlier export left and
/// this one does not have. A list in the folder (kListName) says what is an export's; other files
/// stay, unless they have the name of a new one. Without finish() all stays as it was.
class ExportFolder {
 public:
  static constexpr const char* kListName = "waymark_export.txt";

  /// Makes the folder where it is missing; throws OutputError when that fails.
  explicit ExportFolder(const std::filesystem::path& folder);
  ~ExportFolder();
  ExportFolder(const ExportFolder&) = delete;
  ExportFolder& operator=(const ExportFolder&) = delete;

  /// Where the files are to be made.
  const std::filesystem::path& unfinished() const { return unfinished_; }
  /// Once, after the last file is made. Throws OutputError.
  void finish();

 private:
  const std::filesystem::path folder_;
  const std::filesystem::path unfinished_;
  const bool is_new_;
};

}  // namespace waymark
