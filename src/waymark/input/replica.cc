// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

using ReplicaJson = nlohmann::json;

constexpr double kReplicaRateHz = 30.0;

/// results/ of a scene, or that folder itself.
std::filesystem::path results_of(const std::filesystem::path& folder) {
  return std::filesystem::is_directory(folder / "results") ? folder / "results" : folder;
}

/// Images of the folder whose names begin so.
std::vector<std::filesystem::path> images_named(const std::filesystem::path& folder,
                                                std::string_view start) {
  std::vector<std::filesystem::path> images = list_images(folder);
  std::erase_if(images, [start](const std::filesystem::path& image) {
    return !image.filename().string().starts_with(start);
  });
  return images;
}

/// cam_params.json of the scene or, usually, beside all scenes.
std::filesystem::path find_parameters(const std::filesystem::path& folder) {
  const std::filesystem::path base = std::filesystem::absolute(folder / ".").lexically_normal();
  for (const char* place : {"cam_params.json", "../cam_params.json", "../../cam_params.json"}) {
    const std::filesystem::path candidate = (base / place).lexically_normal();
    if (std::filesystem::exists(candidate)) return candidate;
  }
  return {};
}

CameraChain read_parameters(const std::filesystem::path& path) {
  const std::string text = read_text_file(path, "cam_params.json", std::size_t{1} << 20);
  const ReplicaJson root = ReplicaJson::parse(text, nullptr, /*throw=*/false);
  const auto camera = root.is_object() ? root.find("camera") : root.end();
  const auto number = [&](const char* key) {
    if (camera != root.end() && camera->is_object()) {
      const auto value = camera->find(key);
      if (value != camera->end() && value->is_number()) return value->get<double>();
    }
    throw InputError(
        path.string(),
        fmt::format("has no number camera.{}, expected w, h, fx, fy, cx, cy, scale", key));
  };
  const auto pixels = [&](const char* key) {
    const double value = number(key);
    if (value >= 1.0 && value <= 1e5) return static_cast<int>(value);
    throw InputError(path.string(), fmt::format("camera.{} is {}, expected pixels", key, value));
  };
  CameraDescription description;
  description.where = path.string();
  description.camera_model = "pinhole";
  description.width_px = pixels("w");
  description.height_px = pixels("h");
  description.intrinsics = {number("fx"), number("fy"), number("cx"), number("cy")};
  CameraChain chain;
  chain.cameras.push_back({description, Rigid3()});
  chain.depth_factor = number("scale");
  if (!(*chain.depth_factor >= 1e-3 && *chain.depth_factor <= 1e9)) {
    throw InputError(path.string(),
                     fmt::format("camera.scale is {}, expected units per metre", number("scale")));
  }
  return chain;
}

}  // namespace

bool is_replica(const std::filesystem::path& folder) {
  const std::filesystem::path results = results_of(folder);
  if (count_images(results) == 0) return false;
  return !images_named(results, "frame").empty() && !images_named(results, "depth").empty();
}

Listing list_replica(const std::filesystem::path& folder, const InputOptions& options) {
  Listing listing;
  listing.format = "replica";
  listing.title = "Replica";
  listing.setup = choose_setup(folder, {Setup::kMono, Setup::kRgbd}, options.setup);
  const std::filesystem::path results = results_of(folder);
  const std::vector<std::filesystem::path> images = images_named(results, "frame");
  const std::vector<std::filesystem::path> depths = images_named(results, "depth");
  if (images.empty() || depths.size() != images.size()) {
    throw InputError(results.string(),
                     fmt::format("{} images frameN and {} images depthN, expected as many",
                                 images.size(),
                                 depths.size()));
  }
  listing.has_times = false;
  const std::vector<std::int64_t> times_ns =
      even_times(images.size(), options.fps.value_or(kReplicaRateHz));
  for (std::size_t i = 0; i < images.size(); ++i) {
    listing.frames.push_back({times_ns[i], {images[i]}, {}});
    if (listing.setup == Setup::kRgbd) listing.frames.back().depth = depths[i];
  }
  const std::filesystem::path parameters = find_parameters(folder);
  if (!options.calibration && !parameters.empty()) {
    listing.calibration = read_parameters(parameters);
  }
  return listing;
}

}  // namespace waymark
