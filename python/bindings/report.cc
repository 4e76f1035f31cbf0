// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/report.h"

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/evaluate/report.h"
#include "waymark/report/evaluate_files.h"

namespace waymark::python {
namespace {

std::optional<TrajectoryAlignment> alignment_argument(const py::object& align) {
  if (align.is_none()) return std::nullopt;
  const std::string name = py::isinstance<py::str>(align) ? text_argument("align", align) : "";
  if (name == "se3") return TrajectoryAlignment::kSe3;
  if (name == "sim3") return TrajectoryAlignment::kSim3;
  if (name == "none") return TrajectoryAlignment::kNone;
  throw py::value_error("align: is " + text_argument("align", py::repr(align)) +
                        ", expected se3, sim3, none or None");
}

std::string write_report_page(const py::object& folders,
                              const py::object& groundtruth,
                              const py::object& align,
                              const py::object& path) {
  PageRequest request;
  if (py::isinstance<py::list>(folders) || py::isinstance<py::tuple>(folders)) {
    for (const py::handle folder : folders) {
      request.folders.push_back(
          path_argument("folders", py::reinterpret_borrow<py::object>(folder)));
    }
  } else {
    request.folders.push_back(path_argument("folders", folders));
  }
  if (!groundtruth.is_none()) request.groundtruth = path_argument("ground_truth", groundtruth);
  request.alignment = alignment_argument(align);
  if (!path.is_none()) request.out = path_argument("path", path);
  const ReleasedGil released;
  return write_page(request).string();
}

/// Seconds, or "auto".
void set_time_offset(const py::object& time_offset, EvaluationRequest& request) {
  request.finds_time_offset =
      py::isinstance<py::str>(time_offset) && text_argument("time_offset", time_offset) == "auto";
  if (request.finds_time_offset) return;
  const double seconds = number_argument("time_offset", time_offset);
  if (!(std::abs(seconds) <= kMaxOffsetS)) {
    throw py::value_error("time_offset: is " + text_argument("time_offset", py::repr(time_offset)) +
                          ", expected seconds or auto");
  }
  request.time_offset_ns = std::llround(1e9 * seconds);
}

py::object evaluate_paths(const py::object& estimate,
                          const py::object& groundtruth,
                          const py::object& align,
                          const py::object& time_offset,
                          const py::object& plot) {
  EvaluationRequest request;
  request.groundtruth = path_argument("ground_truth", groundtruth);
  request.alignment = alignment_argument(align);
  set_time_offset(time_offset, request);
  if (!plot.is_none()) request.plot = path_argument("plot", plot);
  const bool is_trajectory = py::isinstance<Trajectory>(estimate);
  std::vector<StampedPose> poses;
  if (is_trajectory) {
    poses = estimate.cast<const Trajectory&>().poses();
  } else {
    request.estimate = path_argument("estimate", estimate);
  }
  std::string text;
  {
    const ReleasedGil released;
    const FileEvaluation result =
        is_trajectory ? evaluate_poses(poses, request) : evaluate_files(request);
    text = format_evaluation_json(result.evaluation, result.notes);
  }
  return py::module_::import("json").attr("loads")(text_of(text));
}

}  // namespace

void bind_report(py::module_& module) {
  module.def("report",
             &write_report_page,
             py::arg("folders"),
             py::arg("ground_truth") = py::none(),
             py::arg("align") = py::none(),
             py::arg("path") = py::none(),
             R"(report(folders, ground_truth=None, align=None, path=None)
--

Writes a page for the browser on what `waymark run` left in a folder, or compares several, as `waymark
report` does: the path of the page.

folders: one folder, or a list of them.
ground_truth: file of true poses to compare with.
align: 'se3', 'sim3' (free scale) or 'none'; by default as the scale of the run is.
path: of the page; by default report.html in the folder, of several comparison.html here.

InputError for folders that hold no results; OutputError.)");
  module.def("evaluate",
             &evaluate_paths,
             py::arg("estimate"),
             py::arg("ground_truth"),
             py::arg("align") = py::none(),
             py::arg("time_offset") = 0.0,
             py::arg("plot") = py::none(),
             R"(evaluate(estimate, ground_truth, align=None, time_offset=0.0, plot=None)
--

Compares a trajectory with the true one: the dict that `waymark eval --json` prints, with ate_rmse_m,
rpe_m, rpe_deg, coverage, scale, notes and more.

estimate: a Trajectory, or a file of poses (TUM, EuRoC csv or KITTI).
ground_truth: a file of true poses.
align: 'se3', 'sim3' (free scale) or 'none'; by default 'sim3' for a file beside the summary.json of
a run without scale, else 'se3'.
time_offset: seconds that are added to the times of the estimate; 'auto': as its speeds agree best.
plot: SVG file to write.

InputError for files that cannot be read or do not go together; OutputError.)");
}

}  // namespace waymark::python
