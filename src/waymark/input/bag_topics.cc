// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <tuple>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/bag_image.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

constexpr std::string_view kRealsenseImage = "/image/data";

bool has(std::string_view name, std::string_view part) {
  return name.find(part) != std::string_view::npos;
}

bool is_packed(const ImageTopic& topic) { return topic.base() != topic.name; }

/// What suits better comes first; of equals the name decides.
auto rank_of(const ImageTopic& topic) {
  const std::string base = topic.base();
  return std::tuple(is_packed(topic), topic.is_rectified(), has(base, "mono"), topic.name);
}

/// One topic of each base name, those that suit better first.
std::vector<ImageTopic> by_rank(std::vector<ImageTopic> topics, bool is_depth) {
  std::erase_if(topics, [&](const ImageTopic& topic) { return topic.is_depth != is_depth; });
  std::ranges::sort(topics, [](const auto& a, const auto& b) { return rank_of(a) < rank_of(b); });
  std::set<std::string> bases;
  std::erase_if(topics,
                [&](const ImageTopic& topic) { return !bases.insert(topic.base()).second; });
  return topics;
}

bool says_registered(std::string_view name) {
  return has(name, "aligned") || has(name, "registered") || has(name, "depth_to");
}

/// How well depth belongs to images: 0 not at all.
int registration(const ImageTopic& image, const ImageTopic& depth) {
  // Its depth is that of the left infrared camera, whose images show the dots of the projector.
  if (image.is_of_realsense()) return 0;
  const bool is_same_frame = !image.frame_id.empty() && image.frame_id == depth.frame_id;
  const bool is_colour = has(image.name, "color") || has(image.name, "rgb");
  if (!is_same_frame && !(says_registered(depth.name) && is_colour)) return 0;
  return 1 + (is_same_frame ? 4 : 0) + (says_registered(depth.name) ? 2 : 0) + (is_colour ? 1 : 0);
}

std::optional<TopicChoice> find_rgbd(const std::vector<ImageTopic>& images,
                                     const std::vector<ImageTopic>& depths) {
  std::optional<TopicChoice> best;
  int best_score = 0;
  for (const ImageTopic& image : images) {
    for (const ImageTopic& depth : depths) {
      const int score = registration(image, depth);
      if (score <= best_score) continue;
      best_score = score;
      best = {Setup::kRgbd, image, depth};
    }
  }
  return best;
}

std::optional<TopicChoice> find_stereo(const std::vector<ImageTopic>& images) {
  for (const ImageTopic& left : images) {
    for (const ImageTopic& right : images) {
      if (are_left_and_right(left.name, right.name))
        return TopicChoice{Setup::kStereo, left, right};
    }
  }
  return std::nullopt;
}

}  // namespace

std::string ImageTopic::base() const {
  for (const std::string_view suffix : {"/compressedDepth", "/compressed"}) {
    if (name.ends_with(suffix)) return name.substr(0, name.size() - suffix.size());
  }
  return name;
}

std::string ImageTopic::camera() const {
  const std::string whole = base();
  const std::string_view end = is_of_realsense() ? kRealsenseImage : "";
  const std::string start = whole.substr(0, whole.size() - end.size());
  return end.empty() ? start.substr(0, start.find_last_of('/')) : start;
}

bool ImageTopic::is_of_realsense() const { return name.ends_with(kRealsenseImage); }

std::vector<std::string> ImageTopic::info_names() const {
  return {camera() + "/camera_info", camera() + "/info/camera_info"};
}

bool ImageTopic::is_rectified() const {
  const std::string whole = base();
  return has(std::string_view(whole).substr(camera().size()), "rect");
}

std::vector<ImageTopic> list_image_topics(Bag& bag) {
  std::vector<ImageTopic> images;
  std::vector<bool> is_seen(bag.content().topics.size());
  for (const BagMessage& message : bag.content().messages) {
    const BagTopic& topic = bag.content().topics[message.topic];
    if (is_seen[message.topic] || topic.type == "sensor_msgs/CameraInfo") continue;
    is_seen[message.topic] = true;
    ImageTopic& image = images.emplace_back(
        ImageTopic{message.topic, topic.name, "", "damaged", false, topic.num_messages});
    try {
      const BagImageHeader header = read_bag_image_header(bag.read(message), topic, topic.name);
      image.frame_id = header.frame_id;
      image.encoding = header.encoding;
      image.is_depth = header.is_depth;
    } catch (const InputError&) {
      // A later message may be whole.
    }
  }
  return images;
}

std::vector<TopicChoice> find_topics(const std::vector<ImageTopic>& topics) {
  const std::vector<ImageTopic> images = by_rank(topics, /*is_depth=*/false);
  const std::vector<ImageTopic> depths = by_rank(topics, /*is_depth=*/true);
  const std::optional<TopicChoice> stereo = find_stereo(images);
  const std::optional<TopicChoice> rgbd = find_rgbd(images, depths);
  std::set<std::string> cameras;
  for (const ImageTopic& image : images) cameras.insert(image.camera());
  const auto colour = std::ranges::find_if(images, [](const ImageTopic& image) {
    return image.is_of_realsense() && has(image.name, "/Color_");
  });

  std::vector<TopicChoice> choices;
  if (rgbd) {
    choices.push_back({Setup::kMono, rgbd->first, std::nullopt});
  } else if (colour != images.end()) {
    choices.push_back({Setup::kMono, *colour, std::nullopt});
  } else if (stereo) {
    choices.push_back({Setup::kMono, stereo->first, std::nullopt});
  } else if (cameras.size() == 1) {
    choices.push_back({Setup::kMono, images.front(), std::nullopt});
  }
  if (stereo) choices.push_back(*stereo);
  if (rgbd) choices.push_back(*rgbd);
  return choices;
}

TopicChoice choose_named_topics(const std::vector<ImageTopic>& topics,
                                const std::vector<std::string>& names,
                                const std::string& bag) {
  std::vector<ImageTopic> chosen;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(topics, name, &ImageTopic::name);
    if (found == topics.end()) {
      throw InputError("--topics",
                       fmt::format("{} is no topic of images in {}, expected of {}",
                                   quote_for_message(name),
                                   bag,
                                   describe(topics)));
    }
    chosen.push_back(*found);
  }
  if (chosen.empty() || chosen.size() > 2 || chosen.front().is_depth) {
    throw InputError("--topics", "expected one or two: images, and those of camera 1 or the depth");
  }
  if (chosen.size() == 1) return {Setup::kMono, chosen[0], std::nullopt};
  return {chosen[1].is_depth ? Setup::kRgbd : Setup::kStereo, chosen[0], chosen[1]};
}

std::string describe(const std::vector<ImageTopic>& topics) {
  std::string text;
  for (const ImageTopic& topic : topics) {
    text += fmt::format("{}{} ({}, {} messages)",
                        text.empty() ? "" : ", ",
                        printable(topic.name),
                        printable(topic.encoding),
                        topic.num_messages);
  }
  return text;
}

}  // namespace waymark
