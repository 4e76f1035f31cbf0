// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/report/report.h"
#include "waymark/results/trajectory.h"

namespace waymark {

void write_report(const std::filesystem::path& folder) { write_page({{folder}, {}, {}, {}}); }

std::filesystem::path write_page(const PageRequest& request) {
  if (request.folders.empty()) {
    throw InputError("report", "has no folder, expected one that waymark run wrote");
  }
  std::vector<RunFolder> runs;
  for (const std::filesystem::path& folder : request.folders) {
    runs.push_back(read_run_folder(folder));
  }
  std::optional<TruePath> truth;
  if (!request.groundtruth.empty()) {
    truth = TruePath{request.groundtruth.filename().string(),
                     read_trajectory(request.groundtruth),
                     request.alignment};
  }
  const TruePath* const known = truth ? &*truth : nullptr;
  const bool is_one = runs.size() == 1;
  std::filesystem::path out = request.out;
  if (out.empty()) out = is_one ? request.folders.front() / "report.html" : "comparison.html";
  write_file_atomically(
      out, is_one ? format_report(runs.front(), known) : format_run_comparison(runs, known));
  return out;
}

}  // namespace waymark
