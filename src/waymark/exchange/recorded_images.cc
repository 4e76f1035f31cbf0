// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/recorded_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/input/decode.h"

namespace waymark {
namespace {

ImageView whole(const Image& image) {
  return {image.values.data(), image.width_px, image.height_px, image.width_px};
}

/// A grey image as a JPEG file.
std::string as_grey_jpeg(const Image& image) {
  ColorImage color(image.width_px, image.height_px);
  std::ranges::transform(image.values, color.values.begin(), [](std::uint8_t grey) {
    return Rgb{grey, grey, grey};
  });
  return encode_jpeg(color);
}

/// Throws for a first frame that the cameras of the map did not take. enlargement: of its images.
void expect_size(const Map& map,
                 const InputFrame& frame,
                 int enlargement,
                 const std::filesystem::path& input) {
  const Image& image = frame.images.front();
  bool is_any = false;
  std::string sizes;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const Camera& camera = *keyframe.rig().cameras[0].camera;
    is_any |= camera.width_px() == image.width_px && camera.height_px() == image.height_px;
    if (sizes.empty()) sizes = fmt::format("{}x{}", camera.width_px(), camera.height_px());
  });
  if (is_any) return;
  throw InputError(input.string(),
                   fmt::format("has images of {}x{} px, expected {} px as the map's camera",
                               image.width_px / enlargement,
                               image.height_px / enlargement,
                               sizes));
}

/// The keyframes of a map at a time, of which there may be some of several recordings.
std::multimap<std::int64_t, KeyframeId> keyframes_by_time(const Map& map) {
  std::multimap<std::int64_t, KeyframeId> by_time;
  map.keyframes().for_each(
      [&](KeyframeId id, const Keyframe& keyframe) { by_time.emplace(keyframe.timestamp_ns, id); });
  return by_time;
}

}  // namespace

RecordedImages::RecordedImages(std::filesystem::path input, InputOptions reading)
    : input_(std::move(input)), reading_(std::move(reading)) {}

std::unique_ptr<Input> RecordedImages::open(bool has_jpeg) const {
  InputOptions reading = reading_;
  reading.has_jpeg = has_jpeg;
  reading.has_right_jpeg = has_jpeg;
  reading.enlarges_small = true;
  return open_input(input_, reading);
}

void RecordedImages::survey(const Map& map, bool has_images) {
  const auto by_time = keyframes_by_time(map);
  const std::unique_ptr<Input> input = open(!has_images);
  if (input->info().is_live) {
    throw InputError(input_.string(), "is a camera, expected a recording");
  }
  while (std::optional<InputFrame> frame = input->next()) {
    if (frame->fault != FrameFault::kNone || frame->images.empty()) continue;
    if (frames_.empty()) expect_size(map, *frame, input->info().enlargement, input_);
    frames_[frame->timestamp_ns] = {.timestamp_ns = frame->timestamp_ns,
                                    .index = frame->index,
                                    .sharpness = sharpness(whole(frame->images.front())),
                                    .num_images = frame->images.size()};
    if (frame->jpeg.empty()) continue;
    const auto [begin, end] = by_time.equal_range(frame->timestamp_ns);
    if (begin == end) continue;
    const auto jpeg = std::make_shared<const std::string>(std::move(frame->jpeg));
    for (auto keyframe = begin; keyframe != end; ++keyframe) {
      keyframe_images_[keyframe->second] = jpeg;
    }
  }
}

void RecordedImages::find(std::vector<FramePlace>& places) const {
  std::erase_if(places, [&](FramePlace& place) {
    const auto frame = frames_.lower_bound(place.timestamp_ns - kSameTimeNs);
    if (frame == frames_.end() || frame->first > place.timestamp_ns + kSameTimeNs) return true;
    const FramePlace at = std::exchange(place, frame->second);
    place.rig_from_world = at.rig_from_world;
    place.nearest = at.nearest;
    return false;
  });
}

void RecordedImages::for_each(const Visitor& visit) const {
  const std::unique_ptr<Input> input = open(true);
  while (std::optional<InputFrame> frame = input->next()) {
    if (frame->jpeg.empty()) continue;
    std::vector<std::string> images = {std::move(frame->jpeg)};
    if (frame->images.size() > 1) {
      images.push_back(frame->right_jpeg.empty() ? as_grey_jpeg(frame->images[1])
                                                 : std::move(frame->right_jpeg));
    }
    visit(frame->timestamp_ns, images);
  }
}

}  // namespace waymark
