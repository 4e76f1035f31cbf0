// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/evaluate/association.h"
#include "waymark/exchange/trajectory.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/features.h"
#include "waymark/image/frame_builder.h"
#include "waymark/input/input.h"

namespace waymark {

/// What a keyframe looked like, and where its camera truly was.
struct RecordedPlace {
  std::vector<Descriptor> descriptors;
  Rigid3 world_from_camera;
};

/// Every n-th frame of a sequence that has a true pose (camera 0, 1000 features). The folder holds
/// an input, camchain.yaml and groundtruth.txt. Throws InputError.
inline std::vector<RecordedPlace> read_places(const std::filesystem::path& folder,
                                              std::size_t every) {
  InputOptions options;
  options.setup = Setup::kMono;
  options.every = every;
  options.calibration =
      read_camchain(parse_config(ConfigSource::from_file(folder / "camchain.yaml")));
  const std::vector<StampedPose> truth = read_trajectory(folder / "groundtruth.txt");
  const std::unique_ptr<Input> input = open_input(folder, options);
  Rig rig = make_rig(input->info().calibration.value());
  rig.cameras.resize(1);
  FrameBuilder builder(rig, FrameSettings{});

  std::vector<RecordedPlace> places;
  while (const std::optional<InputFrame> frame = input->next()) {
    if (frame->fault != FrameFault::kNone) continue;
    const std::array<StampedPose, 1> stamp = {StampedPose{frame->timestamp_ns, Rigid3()}};
    const std::vector<TimeMatch> match = match_by_time(stamp, truth, 20'000'000);
    if (match.empty()) continue;
    FrameImages images;
    images.image0 = frame->images.at(0).view();
    if (frame->mask) images.mask = frame->mask->view();
    places.push_back(
        {builder.build(images)->descriptors, truth[match.front().groundtruth].world_from_camera});
  }
  return places;
}

}  // namespace waymark
