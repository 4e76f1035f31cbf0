// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The readers of settings, calibrations and lists of images. The first byte of the input, a digit,
// says which.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/base/settings.h"
#include "waymark/camera/camchain.h"
#include "waymark/features/frame_builder.h"
#include "waymark/input/config_file.h"
#include "waymark/input/foreign_calibration.h"
#include "waymark/input/image_times.h"

namespace {

using waymark::CameraChain;
using waymark::ConfigSource;

CameraChain read_own(const ConfigSource& source) {
  const waymark::ConfigNode config = waymark::parse_config(source);
  waymark::FeatureSettings settings;
  waymark::read_settings(settings, config);
  return waymark::read_camchain(config).value_or(CameraChain());
}

CameraChain read_any(const ConfigSource& source) {
  return waymark::read_foreign_cameras(source).value_or(CameraChain());
}

CameraChain read_list(const ConfigSource& source) {
  const waymark::ImageList list = waymark::parse_image_list(source.text, source.name);
  waymark::times_in_names(list.images);
  return {};
}

constexpr std::array kReaders = {read_own,
                                 waymark::read_opencv_calibration,
                                 waymark::read_ros_calibration,
                                 waymark::read_colmap_calibration,
                                 waymark::read_nerfstudio_calibration,
                                 read_any,
                                 read_list};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto reader = static_cast<std::size_t>(data[0] - '0') % kReaders.size();
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const CameraChain chain = kReaders[reader]({"fuzz", text});
    if (!chain.cameras.empty()) waymark::make_rig(chain);
  } catch (const waymark::InputError& error) {
    WAYMARK_CHECK(std::string_view(error.what()).find("\n") == std::string_view::npos);
  }
  return 0;
}
