// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/calibration.h"

#include <fmt/format.h>

#include "waymark/base/check.h"
#include "waymark/input/listing.h"

namespace waymark {

std::optional<CameraChain> choose_calibration(const std::filesystem::path& path,
                                              const std::optional<CameraChain>& given,
                                              const std::optional<CameraChain>& carried,
                                              Setup setup) {
  std::optional<CameraChain> chain = given ? given : carried;
  if (!chain) return std::nullopt;
  const std::size_t num_needed = num_cameras(setup);
  if (chain->cameras.size() < num_needed) {
    throw InputError(
        path.string(),
        fmt::format(
            "calibration of {} camera(s), expected {} for {}; --setup mono uses camera 0 alone",
            chain->cameras.size(),
            num_needed,
            to_string(setup)));
  }
  chain->cameras.resize(num_needed);
  return chain;
}

void fit_first_image(CameraChain& chain,
                     std::size_t camera,
                     const ImageSize& size,
                     const std::filesystem::path& image) {
  CameraDescription& description = chain.cameras.at(camera).description;
  if (description.width_px == 0 && description.height_px == 0) {
    description.width_px = size.width_px;
    description.height_px = size.height_px;
  }
  if (size == ImageSize{description.width_px, description.height_px}) return;
  throw InputError(
      image.string(),
      fmt::format("is {}x{} px, expected {}x{} px as the calibration of camera {} says",
                  size.width_px,
                  size.height_px,
                  description.width_px,
                  description.height_px,
                  camera));
}

std::string describe_calibration(bool is_given, const std::optional<CameraChain>& chain) {
  if (!chain) return "no calibration in the data set: it must come from the settings";
  std::string text = is_given ? "calibration from the settings:" : "calibration from the data set:";
  for (const ChainCamera& camera : chain->cameras) {
    const CameraDescription& description = camera.description;
    text += fmt::format(" {}", description.camera_model);
    if (description.distortion_model != "none")
      text += fmt::format("-{}", description.distortion_model);
  }
  if (chain->cameras.size() == 2) {
    text += fmt::format(", baseline {:.4g} m", chain->cameras[1].cam_from_rig.translation.norm());
  }
  return text;
}

}  // namespace waymark
