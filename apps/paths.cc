// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/results/results.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReads = "reads";
constexpr const char* kWrites = "writes";
constexpr const char* kWritesResults = "writes results";

/// A path, and the option that names it.
struct NamedPath {
  std::string option;
  fs::path path;
};

/// An option carries a mark as the name of a check that passes everything.
CLI::Option* mark(CLI::Option* option, const char* name) {
  CLI::Validator passes{std::string()};
  return option->check(passes.name(name));
}

bool is_marked(CLI::Option& option, const char* name) {
  try {
    return option.get_validator(name) != nullptr;
  } catch (const CLI::OptionNotFound&) {
    return false;
  }
}

/// The paths of options with a mark, of a command that was given and what is below it.
void add_paths(CLI::App& command, const char* name, std::vector<NamedPath>& paths) {
  for (CLI::Option* const option : command.get_options()) {
    if (!is_marked(*option, name)) continue;
    std::vector<std::string> values = option->results();
    if (values.empty() && !option->get_default_str().empty()) values = {option->get_default_str()};
    for (const std::string& value : values) {
      if (!value.empty()) paths.push_back({option->get_name(), value});
    }
  }
  for (CLI::App* const below : command.get_subcommands()) add_paths(*below, name, paths);
}

std::vector<NamedPath> paths_of(CLI::App& program, const char* name) {
  std::vector<NamedPath> paths;
  add_paths(program, name, paths);
  return paths;
}

/// Whether two names lead to the same, which need not be there.
bool is_same(const fs::path& a, const fs::path& b) {
  std::error_code ignored, a_error, b_error;
  if (fs::equivalent(a, b, ignored)) return true;
  const fs::path a_resolved = fs::weakly_canonical(fs::absolute(a), a_error);
  return a_resolved == fs::weakly_canonical(fs::absolute(b), b_error) && !a_error && !b_error;
}

/// Whether a name is one that the results of a folder have.
bool is_result_in(const fs::path& file, const fs::path& folder) {
  const fs::path parent = file.has_parent_path() ? file.parent_path() : fs::path(".");
  return is_result_name(file.filename().string()) && is_same(parent, folder);
}

/// Whether a file among those of an input is none of it: what only this program writes.
bool is_no_input(const fs::path& file, const fs::path& folder) {
  constexpr std::array kKinds = {".wmap", ".html", ".svg", ".log"};
  return std::ranges::find(kKinds, file.extension().string()) != kKinds.end() && !is_atlas(folder);
}

/// Whether a file that is there is one of those in a folder; results of runs in it are not.
bool is_within(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(file, error) || is_no_input(file, folder)) return false;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_directory(ignored)) {
      if (holds_results(entry->path())) entry.disable_recursion_pending();
    } else if (fs::equivalent(entry->path(), file, ignored)) {
      return true;
    }
  }
  return false;
}

[[noreturn]] void fail(const NamedPath& written, const NamedPath& other, const char* why) {
  throw InputError(written.option,
                   fmt::format("{} {} {} ({}), expected another name",
                               quote_for_message(written.path.string()),
                               why,
                               other.option,
                               quote_for_message(other.path.string())));
}

/// Whether a path is in a folder that is replaced as a whole. An atlas keeps what is in it.
bool is_in_replaced(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error) || is_atlas(folder)) return false;
  for (fs::path above = fs::weakly_canonical(path, error); above.has_relative_path();) {
    above = above.parent_path();
    if (fs::equivalent(above, folder, error)) return true;
  }
  return false;
}

void protect(const NamedPath& read, const NamedPath& written) {
  const bool goes_on = written.option == "--map-out" && read.option == "--map-in";
  if (!goes_on && is_same(read.path, written.path)) fail(written, read, "would replace");
  const bool is_replaced = written.option != "ATLAS";  // Which is added to, if it is one.
  if (is_replaced && is_in_replaced(read.path, written.path)) fail(written, read, "holds");
  if (is_within(written.path, read.path)) fail(written, read, "would replace a file of");
}

/// Results leave alone what has another name.
void protect_from_results(const NamedPath& other, const NamedPath& folder) {
  if (is_same(other.path, folder.path)) fail(folder, other, "is");
  std::error_code error;
  bool is_replaced = is_result_in(other.path, folder.path);
  for (fs::directory_iterator entry(folder.path, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    is_replaced |= is_result_name(entry->path().filename().string()) &&
                   fs::equivalent(entry->path(), other.path, ignored);
  }
  if (is_replaced) fail(folder, other, "would get results in place of");
}

}  // namespace

CLI::Option* reads(CLI::Option* option) { return mark(option, kReads); }
CLI::Option* writes(CLI::Option* option) { return mark(option, kWrites); }
CLI::Option* writes_results(CLI::Option* option) { return mark(option, kWritesResults); }

void protect_inputs(CLI::App& program) {
  const std::vector<NamedPath> read = paths_of(program, kReads);
  const std::vector<NamedPath> written = paths_of(program, kWrites);
  const std::vector<NamedPath> results = paths_of(program, kWritesResults);
  for (std::size_t i = 0; i < written.size(); ++i) {
    for (const NamedPath& other : read) protect(other, written[i]);
    for (std::size_t k = 0; k < i; ++k) {
      if (is_same(written[i].path, written[k].path)) fail(written[i], written[k], "is that of");
    }
  }
  for (const NamedPath& folder : results) {
    for (const NamedPath& other : read) protect_from_results(other, folder);
    for (const NamedPath& other : written) protect_from_results(other, folder);
  }
}

}  // namespace waymark
