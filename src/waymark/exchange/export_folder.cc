// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_folder.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <set>
#include <string>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Of files, relative to the folder of the export.
using ExportedNames = std::set<fs::path>;

ExportedNames read_export_list(const fs::path& path) {
  ExportedNames names = {ExportFolder::kListName};
  if (std::error_code error; !fs::is_regular_file(path, error)) return names;
  std::ifstream stream(path);
  for (std::string line; std::getline(stream, line);) names.insert(line);
  return names;
}

ExportedNames files_below(const fs::path& folder) {
  ExportedNames names;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const bool is_folder = entry.is_directory() && !entry.is_symlink();
    if (!is_folder) names.insert(entry.path().lexically_relative(folder));
  }
  return names;
}

/// What a name leads to: a link stays, and where it leads is replaced.
fs::path resolve(const fs::path& folder) {
  std::error_code error;
  fs::path resolved = fs::weakly_canonical(folder, error);
  if (error) resolved = fs::absolute(folder);
  return resolved.has_filename() ? resolved : resolved.parent_path();
}

/// Beside the folder, hidden.
fs::path beside(const fs::path& folder, const char* what) {
  return folder.parent_path() / fmt::format(".{}.waymark_{}", folder.filename().string(), what);
}

/// Throws unless the folder is missing, empty, or just what an export left.
void expect_replaceable(const fs::path& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (status.type() == fs::file_type::not_found) return;
  if (!fs::is_directory(status)) {
    throw OutputError(folder.string(), "is a file, expected a folder or a new name");
  }
  try {
    const ExportedNames listed = read_export_list(folder / ExportFolder::kListName);
    for (const fs::path& name : files_below(folder)) {
      if (listed.contains(name)) continue;
      throw InputError(
          folder.string(),
          fmt::format("holds {}, which no earlier command of the same kind left there, "
                      "expected a new or empty folder, or what one left",
                      quote_for_message(name.string())));
    }
  } catch (const fs::filesystem_error& failure) {
    throw OutputError(folder.string(), "cannot be read: " + failure.code().message());
  }
}

[[noreturn]] void fail_rename(const fs::path& folder, const std::error_code& error) {
  throw OutputError(folder.string(),
                    "cannot be written: " + error.message() + ", expected a new name");
}

/// Puts a folder where another is, which then has its name: at no moment is there none. Where the
/// file system cannot do that, the other goes out of the way first.
void exchange(const fs::path& made, const fs::path& folder) {
  if (::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) == 0) return;
  const fs::path earlier = beside(folder, "earlier");
  std::error_code error, ignored;
  fs::remove_all(earlier, ignored);
  fs::rename(folder, earlier, error);
  if (error) fail_rename(folder, error);
  fs::rename(made, folder, error);
  fs::rename(earlier, error ? folder : made, ignored);
  if (error) fail_rename(folder, error);
}

}  // namespace

ExportFolder::ExportFolder(const fs::path& folder)
    : folder_(resolve(folder)), unfinished_(beside(folder_, "partial")) {
  expect_replaceable(folder_);
  std::error_code ignored;
  is_again_ = fs::exists(folder_ / kListName, ignored);
  fs::remove_all(unfinished_, ignored);  // Of a program that was killed.
  make_output_folder(unfinished_);
}

ExportFolder::~ExportFolder() {
  std::error_code ignored;
  fs::remove_all(unfinished_, ignored);
}

void ExportFolder::finish() {
  std::string list;
  for (const fs::path& name : files_below(unfinished_)) list += name.generic_string() + "\n";
  write_file_atomically(unfinished_ / kListName, list);
  expect_replaceable(folder_);
  std::error_code error;
  if (fs::exists(folder_, error)) return exchange(unfinished_, folder_);
  fs::rename(unfinished_, folder_, error);
  if (error) fail_rename(folder_, error);
}

}  // namespace waymark
