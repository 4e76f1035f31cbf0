// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "recorded_places.h"

#include <array>
#include <memory>
#include <optional>

#include "waymark/base/config.h"
#include "waymark/evaluate/association.h"
#include "waymark/exchange/trajectory.h"
#include "waymark/image/frame_builder.h"
#include "waymark/input/input.h"

namespace waymark {
namespace {

constexpr std::int64_t kMaxDifference_ns = 20'000'000;

}  // namespace

std::vector<RecordedPlace> read_places(const std::filesystem::path& folder, std::size_t every) {
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
    const std::vector<TimeMatch> match = match_by_time(stamp, truth, kMaxDifference_ns);
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
