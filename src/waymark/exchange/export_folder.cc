// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_folder.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnfinishedName = ".waymark_export.partial";

bool is_missing(const fs::path& path) {
  std::error_code error;
  return fs::status(path, error).type() == fs::file_type::not_found;
}

/// Of files, relative to the folder of the export.
using ExportedNames = std::set<fs::path>;

/// A list may have come from anywhere: only what is below the folder counts.
bool is_below(const fs::path& name) {
  return !name.empty() && name.is_relative() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".."; });
}

ExportedNames read_export_list(const fs::path& path) {
  ExportedNames names;
  std::ifstream stream(path);
  for (std::string line; std::getline(stream, line);) {
    if (is_below(line)) names.insert(line);
  }
  return names;
}

void write_export_list(const fs::path& path, const ExportedNames& names) {
  std::string text;
  for (const fs::path& name : names) text += name.generic_string() + "\n";
  write_file_atomically(path, text);
}

ExportedNames files_below(const fs::path& folder) {
  ExportedNames names;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_directory()) names.insert(entry.path().lexically_relative(folder));
  }
  return names;
}

void move_export(const fs::path& from, const fs::path& to) {
  make_output_folder(to.parent_path());
  std::error_code error;
  fs::rename(from, to, error);
  if (!error) return;
  throw OutputError(to.string(),
                    "cannot be written: " + error.message() + ", expected a file or a new name");
}

/// Removes a file and the folders that are empty then, up to that of the export.
void remove_exported(const fs::path& folder, fs::path name) {
  std::error_code error;
  if (fs::is_directory(folder / name, error)) return;
  while (!name.empty() && fs::remove(folder / name, error)) name = name.parent_path();
}

}  // namespace

ExportFolder::ExportFolder(const fs::path& folder)
    : folder_(folder), unfinished_(folder / kUnfinishedName), is_new_(is_missing(folder)) {
  std::error_code ignored;
  fs::remove_all(unfinished_, ignored);  // Of a program that was killed.
  make_output_folder(unfinished_);
}

ExportFolder::~ExportFolder() {
  std::error_code ignored;
  fs::remove_all(unfinished_, ignored);
  if (is_new_) fs::remove(folder_, ignored);  // Unless there is something in it.
}

void ExportFolder::finish() {
  const ExportedNames names = files_below(unfinished_);
  ExportedNames all = read_export_list(folder_ / kListName);
  ExportedNames gone;
  std::ranges::set_difference(all, names, std::inserter(gone, gone.end()));
  all.insert(names.begin(), names.end());
  // At any moment all that is an export's is in the list.
  write_export_list(folder_ / kListName, all);
  for (const fs::path& name : names) move_export(unfinished_ / name, folder_ / name);
  for (const fs::path& name : gone) remove_exported(folder_, name);
  write_export_list(folder_ / kListName, names);
}

}  // namespace waymark
