// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/mapfile/map_file.h"
#include "waymark/system/system.h"
#include "waymark/view/publisher.h"
#include "waymark/view/viewer.h"

namespace waymark::python {

namespace py = pybind11;

/// A viewer of a map or of a system that is fed, until it is closed. Any thread may call it that
/// holds the GIL, which is what guards it.
class PythonViewer {
 public:
  /// Throws InputError where it cannot listen.
  PythonViewer(const ViewerOptions& address, const StoredMap& stored);
  PythonViewer(const ViewerOptions& address, const std::string& setup, const std::string& timing);

  /// Of the system that is shown; nothing once it is closed.
  void tell(const System& system, const FrameImages& input, const TrackingResult& result);
  void finish(const System& system);
  void reset();
  void set_mapping(bool is_on);

  /// Where to look; empty once it is closed.
  std::string url();
  /// What the page asked for since the last call, by the names that Python has for it.
  std::vector<std::string> requests();
  void close();

 private:
  std::unique_ptr<Viewer> viewer_;
  std::unique_ptr<ViewPublisher> publisher_;
};

/// "8080", "0.0.0.0:8080" or 8080: TypeError, InputError for others.
ViewerOptions address_argument(const py::object& address);

}  // namespace waymark::python
