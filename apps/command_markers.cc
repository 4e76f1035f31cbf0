// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "numbers.h"
#include "paths.h"
#include "terminal.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/marker/sheet.h"

namespace waymark {
namespace {

struct MarkersOptions {
  std::filesystem::path print;
  std::string family = "tag36h11";
  double size_m = 0.16;
  std::string ids = "0";
  Paper paper;
};

int to_id(const std::string& text) {
  if (text.empty() || text.size() > 6 ||
      text.find_first_not_of("0123456789") != std::string::npos) {
    throw InputError("--ids", fmt::format("'{}' is no number, expected 0,1,5-7", text));
  }
  return std::stoi(text);
}

/// Of "0,1,5-7".
std::vector<int> parse_ids(const std::string& text, const MarkerFamily& family) {
  std::vector<int> ids;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    const std::size_t dash = part.find('-');
    const int first = to_id(part.substr(0, dash));
    const int last = dash == std::string::npos ? first : to_id(part.substr(dash + 1));
    if (last < first || last >= family.size()) {
      throw InputError("--ids",
                       fmt::format("'{}' is no range of ids, expected 0 to {} of {}",
                                   part,
                                   family.size() - 1,
                                   family.name()));
    }
    for (int id = first; id <= last; ++id) ids.push_back(id);
    begin = end + 1;
  }
  return ids;
}

int print_families() {
  for (const std::string& name : marker_families()) {
    const MarkerFamily family(name);
    print_result("{} {} markers of {} x {} modules\n",
                 name,
                 family.size(),
                 family.side_modules(),
                 family.side_modules());
  }
  return kDone;
}

/// sheet.svg, sheet-2.svg ...
std::filesystem::path page_path(const std::filesystem::path& path, std::size_t page) {
  if (page == 0) return path;
  std::filesystem::path next = path;
  next.replace_filename(
      fmt::format("{}-{}{}", path.stem().string(), page + 1, path.extension().string()));
  return next;
}

int print_markers(const MarkersOptions& options) {
  if (options.print.empty()) return print_families();
  const MarkerFamily family(options.family, "--family");
  const std::vector<int> ids = parse_ids(options.ids, family);
  if (options.print.extension() == ".pdf") {
    write_file_atomically(options.print,
                          marker_sheets_pdf(family, options.size_m, ids, options.paper));
    print_result("{}\n", options.print.string());
    return kDone;
  }
  const std::vector<std::string> pages = marker_sheets(family, options.size_m, ids, options.paper);
  for (std::size_t i = 0; i < pages.size(); ++i) {
    write_file_atomically(page_path(options.print, i), pages[i]);
    print_result("{}\n", page_path(options.print, i).string());
  }
  return kDone;
}

}  // namespace

void add_markers_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<MarkersOptions>();
  CLI::App& markers =
      *program.add_subcommand("markers", "Square markers: the families there are, sheets to print");
  writes(
      markers.add_option("--print",
                         options->print,
                         "PDF file of sheets, or SVG file for one, further ones FILE-2.svg ..."));
  markers.add_option("--family", options->family, "Which markers")->capture_default_str();
  markers.add_option("--size", options->size_m, "Side of the black square in metres")
      ->check(number_between(0.001, 10.0))
      ->capture_default_str();
  markers.add_option("--ids", options->ids, "Which ones, as 0,1,5-7")->capture_default_str();
  add_choice<Paper>(markers,
                    "--paper",
                    options->paper,
                    {{"a4", {210.0, 297.0}},
                     {"a3", {297.0, 420.0}},
                     {"a0", {841.0, 1189.0}},
                     {"letter", {215.9, 279.4}}},
                    "a4, a3, a0 or letter [a4]");
  markers.callback(
      [options, &command] { command = [options] { return print_markers(*options); }; });
}

}  // namespace waymark
