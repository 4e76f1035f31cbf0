// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/bag/bag.h"
#include "waymark/input/input.h"

namespace waymark {

/// A topic of images in a bag, as far as names and first messages tell.
struct ImageTopic {
  std::uint32_t topic = 0;  ///< Index into the topics of the bag.
  std::string name;         ///< "/camera/image_raw/compressed".
  std::string frame_id;     ///< The coordinate frame of its images.
  std::string encoding;     ///< "mono8", "jpeg", ...
  bool is_depth = false;    ///< Distances rather than brightness.
  std::size_t num_messages = 0;

  /// Without what names the compression: "/camera/image_raw".
  std::string base() const;
  /// What topics of one camera share: "/camera".
  std::string camera() const;
  /// Whether it is of a file that the recorder of RealSense wrote, "/device_0/.../image/data".
  bool is_of_realsense() const;
  /// The names that the camera info of its images may have.
  std::vector<std::string> info_names() const;
  /// Whether its images are those of an ideal camera, by its name.
  bool is_rectified() const;
};

/// Every topic of images with what its first message tells.
std::vector<ImageTopic> list_image_topics(Bag& bag);

/// The topics to use. second: the images of camera 1, or the depth of camera 0.
struct TopicChoice {
  Setup setup = Setup::kMono;
  ImageTopic first;
  std::optional<ImageTopic> second;
};

/// All that a bag offers, the richest setup in the end: one camera; a left and a right one; colour
/// with depth that is registered to it, which has the same coordinate frame or says so in its name.
/// Raw topics go before compressed ones, and of the topics of one camera the unprocessed first. Of
/// several cameras without a relation none is chosen.
std::vector<TopicChoice> find_topics(const std::vector<ImageTopic>& topics);

/// The choice for topics that the user names, one or two. Throws InputError for a name that is
/// none.
TopicChoice choose_named_topics(const std::vector<ImageTopic>& topics,
                                const std::vector<std::string>& names,
                                const std::string& bag);

/// "/a (mono8, 300 messages), /b (...)".
std::string describe(const std::vector<ImageTopic>& topics);

}  // namespace waymark
