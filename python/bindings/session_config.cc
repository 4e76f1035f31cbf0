// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "texts.h"
#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"
#include "waymark/input/config_file.h"

namespace waymark::python {
namespace {

constexpr const char* kExpectedCameras =
    "the path of a camchain, a dict with the same content, several of these, or a Calibration";

constexpr int kMaxNesting = 8;

/// YAML of a value of Python's: JSON is YAML.
std::string yaml_of(const char* name, py::handle value) {
  const py::cpp_function numpy_values([name](const py::object& object) -> py::object {
    if (!py::hasattr(object, "tolist")) fail_type(name, object, "what YAML can hold");
    return object.attr("tolist")();
  });
  const py::object json = py::module_::import("json").attr("dumps");
  try {
    return text_argument(name, json(value, py::arg("default") = numpy_values));
  } catch (const py::error_already_set& error) {
    const bool is_endless = error.matches(PyExc_RecursionError);  // Or too deep, which is the same.
    if (!is_endless && !error.matches(PyExc_ValueError)) throw;
    const std::string why = text_argument(name, py::str(error.value()));
    throw InputError(name, "cannot be written down (" + why + "), expected what YAML can hold");
  }
}

bool is_path(py::handle value) {
  return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}

CameraChain read_slam_settings(const ConfigSource& source) {
  const py::object read = py::module_::import("waymark.importing_settings").attr("read");
  return read(py::bytes(source.name), py::bytes(source.text)).cast<CameraChain>();
}

void add_files(const std::vector<std::filesystem::path>& paths,
               std::vector<ConfigSource>& sources) {
  std::vector<std::string> notes;
  std::ranges::move(read_config_files(paths, notes, read_slam_settings),
                    std::back_inserter(sources));
}

void add_sources(py::handle cameras, std::vector<ConfigSource>& sources, int nesting = 0) {
  if (nesting > kMaxNesting) {
    throw InputError("cameras",
                     "are lists nested deeper than " + std::to_string(kMaxNesting) + ", expected " +
                         kExpectedCameras);
  }
  if (py::isinstance<py::dict>(cameras)) {
    sources.push_back({"cameras", yaml_of("cameras", cameras)});
  } else if (py::isinstance<py::list>(cameras) || py::isinstance<py::tuple>(cameras)) {
    // Files beside each other may be of a pair.
    std::vector<std::filesystem::path> paths;
    for (const py::handle part : cameras) {
      if (is_path(part)) paths.push_back(path_argument("cameras", part));
    }
    if (paths.size() == py::len(cameras)) return add_files(paths, sources);
    for (const py::handle part : cameras) add_sources(part, sources, nesting + 1);
  } else if (is_path(cameras)) {
    add_files({path_argument("cameras", cameras)}, sources);
  } else {
    fail_type("cameras", cameras, kExpectedCameras);
  }
}

CameraChain chain_of(const ConfigNode& config) {
  std::optional<CameraChain> chain = read_camchain(config);
  if (!chain) throw InputError("cameras", "describe no camera, expected cam0");
  return *std::move(chain);
}

void add_settings(py::handle settings, std::vector<ConfigSource>& sources) {
  if (settings.is_none()) return;
  if (!py::isinstance<py::dict>(settings)) {
    fail_type("settings", settings, "a dict such as {\"features.count\": 1500}");
  }
  for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(settings)) {
    if (!py::isinstance<py::str>(key)) fail_type("settings", key, "names of settings as keys");
    // As on the command line, which checks the key.
    ConfigSource source = ConfigSource::from_assignment(text_argument("settings", key) + "=");
    source.name = "settings";
    source.text = yaml_of("settings", value);
    sources.push_back(std::move(source));
  }
}

/// The cameras of a document or, where the calibration is given, that with what the document adds.
CameraChain complete(std::optional<CameraChain> chain, const ConfigNode& config) {
  if (!chain) return chain_of(config);
  if (const auto factor = read_depth_factor(config)) chain->depth_factor = factor;
  return *std::move(chain);
}

void limit_cameras(CameraChain& chain, std::optional<Setup>& setup) {
  if (!setup && chain.cameras.size() == 2) setup = Setup::kStereo;
  const std::size_t wanted = setup == Setup::kStereo ? 2 : 1;
  if (chain.cameras.size() < wanted) {
    throw InputError("cameras", "describe one camera, expected two for setup stereo");
  }
  if (!setup && chain.cameras.size() > wanted) {
    throw InputError("cameras", "are more than two, expected a setup that says which to use");
  }
  chain.cameras.resize(wanted);
}

}  // namespace

std::optional<Setup> setup_argument(py::handle setup) {
  if (setup.is_none()) return std::nullopt;
  if (!py::isinstance<py::str>(setup)) fail_type("setup", setup, "mono, stereo, rgbd or None");
  const std::string name = text_argument("setup", setup);
  for (const Setup known : {Setup::kMono, Setup::kStereo, Setup::kRgbd}) {
    if (name == to_string(known)) return known;
  }
  throw py::value_error("setup: is " + quote_for_message(name) +
                        ", expected mono, stereo, rgbd or None");
}

Timing timing_argument(const std::string& name) {
  if (name == "inline") return Timing::kInline;
  if (name == "lockstep") return Timing::kLockstep;
  if (name == "realtime") return Timing::kRealtime;
  throw py::value_error("timing: is " + quote_for_message(name) +
                        ", expected inline, lockstep or realtime");
}

CameraChain read_cameras(py::handle cameras) {
  if (py::isinstance<CameraChain>(cameras)) return py::cast<CameraChain>(cameras);
  std::vector<ConfigSource> sources;
  add_sources(cameras, sources);
  return chain_of(merge_configs(sources));
}

SessionConfig read_session_config(const ConfigArguments& arguments) {
  SessionConfig result;
  result.setup = setup_argument(arguments.setup);
  std::vector<ConfigSource> sources;
  std::optional<CameraChain> chain;
  if (py::isinstance<CameraChain>(arguments.cameras)) {
    chain = py::cast<CameraChain>(arguments.cameras);
  } else {
    add_sources(arguments.cameras, sources);
  }
  add_settings(arguments.settings, sources);
  const ConfigNode config = merge_configs(sources);
  read_settings(result.settings, config);
  CameraChain complete_chain = complete(std::move(chain), config);
  if (complete_chain.depth_factor) result.settings.depth.factor = *complete_chain.depth_factor;
  if (!arguments.seed.is_none()) {
    // Read as a setting, which checks its range.
    const std::string seed = std::to_string(integer_argument("seed", arguments.seed));
    read_settings(result.settings, parse_config({"seed", seed, "seed"}));
  }
  limit_cameras(complete_chain, result.setup);
  result.rig = make_rig(complete_chain);
  return result;
}

}  // namespace waymark::python
