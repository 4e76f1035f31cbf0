// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "viewer.h"

#include <pybind11/stl.h>

#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/view/saved_map.h"

namespace waymark::python {
namespace {

std::string name_of(ViewRequest::Kind kind) {
  switch (kind) {
    case ViewRequest::Kind::kPause:
      return "pause";
    case ViewRequest::Kind::kResume:
      return "resume";
    case ViewRequest::Kind::kReset:
      return "reset";
    case ViewRequest::Kind::kSave:
      return "save";
    case ViewRequest::Kind::kMappingOn:
      return "mapping_on";
    case ViewRequest::Kind::kMappingOff:
      return "mapping_off";
    case ViewRequest::Kind::kStop:
      return "stop";
    case ViewRequest::Kind::kImage:
      return "image";
    case ViewRequest::Kind::kScale:
      return "scale";
  }
  return "";
}

SessionInfo session_info() {
  SessionInfo info;
  info.program = std::string("waymark ") + WAYMARK_VERSION;
  info.input = "Python";
  return info;
}

}  // namespace

PythonViewer::PythonViewer(const ViewerOptions& address, const StoredMap& stored) {
  SessionInfo info = session_info();
  info.is_live = false;
  info.keeps_images = !stored.images.empty();
  viewer_ = std::make_unique<Viewer>(address, std::move(info));
  ViewUpdate update = show_saved_map(stored);
  viewer_->try_push(update);
}

PythonViewer::PythonViewer(const ViewerOptions& address,
                           const std::string& setup,
                           const std::string& timing) {
  SessionInfo info = session_info();
  info.setup = setup;
  info.timing = timing;
  viewer_ = std::make_unique<Viewer>(address, std::move(info));
  publisher_ = std::make_unique<ViewPublisher>(*viewer_, std::nullopt);
}

void PythonViewer::tell(const System& system,
                        const FrameImages& input,
                        const TrackingResult& result) {
  if (publisher_) publisher_->tell(system, input, result);
}

void PythonViewer::finish(const System& system) {
  if (publisher_) publisher_->finish(system);
}

void PythonViewer::reset() {
  if (publisher_) publisher_->reset();
}

void PythonViewer::set_mapping(bool is_on) {
  if (publisher_) publisher_->set_mapping(is_on);
}

std::string PythonViewer::url() { return viewer_ ? viewer_->url() : ""; }

std::vector<std::string> PythonViewer::requests() {
  std::vector<std::string> names;
  if (!viewer_) return names;
  while (const std::optional<ViewRequest> request = viewer_->next_request()) {
    names.push_back(name_of(request->kind));
  }
  return names;
}

void PythonViewer::close() {
  std::unique_ptr<ViewPublisher> publisher = std::move(publisher_);
  std::unique_ptr<Viewer> viewer = std::move(viewer_);
  const ReleasedGil released;
  publisher.reset();
  viewer.reset();
}

ViewerOptions address_argument(const py::object& address) {
  if (PyIndex_Check(address.ptr())) {
    return parse_viewer_address(std::to_string(integer_argument("address", address)), "address");
  }
  if (!py::isinstance<py::str>(address)) fail_type("address", address, "a port or 'HOST:PORT'");
  return parse_viewer_address(text_argument("address", address), "address");
}

void bind_viewer(py::module_& module) {
  Class<PythonViewer, std::shared_ptr<PythonViewer>>(
      module, "Viewer", R"(A page for browsers that shows a map or a system, from view().

It is there until close(), at the end of a block that it is the context of, or when nothing holds
the object any more; a System holds its own.)")
      .def_property_readonly(
          "url",
          [](PythonViewer& self) { return self.url(); },
          "str: what to open in a browser; empty once it is closed.")
      .def(
          "requests",
          [](PythonViewer& self) { return self.requests(); },
          R"(requests(self)
--

What the page asked for since the last call, oldest first: list of 'pause', 'resume', 'reset',
'mapping_on', 'mapping_off', 'stop'. Who feeds the system does it, or does not.)")
      .def(
          "close",
          [](PythonViewer& self) { self.close(); },
          R"(close(self)
--

Ends the page; browsers get up to a second to take in the last of it.)")
      .def("__enter__", [](const py::object& self) { return self; })
      .def("__exit__", [](PythonViewer& self, const py::args&) { self.close(); })
      .def("__repr__", [](PythonViewer& self) {
        const std::string url = self.url();
        return url.empty() ? std::string("<Viewer, closed>") : "<Viewer at " + url + ">";
      });
}

}  // namespace waymark::python
