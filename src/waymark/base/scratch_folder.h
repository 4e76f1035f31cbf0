// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace waymark {

/// A new folder, PREFIX and six more letters, for what one program writes and nobody else is to
/// see yet. It goes with this object. A program that is killed leaves it behind, but not its lock
/// (flock(2), also between machines that share a folder), by which others tell that nobody is left
/// who uses it. OutputError where none can be made.
class ScratchFolder {
 public:
  /// Makes it. prefix: its folder and how its name begins.
  explicit ScratchFolder(const std::filesystem::path& prefix);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  /// Where it is.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

/// Removes what programs that were killed left under names of this prefix: folders whose lock
/// nobody has, and files.
void remove_abandoned_scratch(const std::filesystem::path& prefix);

}  // namespace waymark
