// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/documentation.h"

#include <system_error>

namespace waymark {

std::string documentation(const std::string& page, const std::filesystem::path& program) {
  const std::filesystem::path installed =
      program.parent_path().parent_path() / "share" / "doc" / "waymark";
  std::error_code error;
  const bool is_there = std::filesystem::exists(installed / page.substr(0, page.find('#')), error);
  return is_there ? (installed / page).string() : page;
}

std::string documentation(const std::string& page) {
  std::error_code error;
  return documentation(page, std::filesystem::read_symlink("/proc/self/exe", error));
}

}  // namespace waymark
