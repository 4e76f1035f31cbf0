// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/report.h"

#include <optional>
#include <string>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "texts.h"

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
}

}  // namespace waymark::python
