// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "waymark/bag/bag_content.h"

namespace waymark {

/// One file of a bag, of which messages are read.
class BagFile {
 public:
  virtual ~BagFile() = default;
  /// The bytes of a message. Throws InputError when they are damaged or gone.
  virtual std::string read(const BagPlace& place) = 0;
};

// Each reads a file to its end, adds what is in it, and opens it. file: its index in the bag. A
// file that is cut off or damaged gives what is whole and a line among the faults. Throws
// InputError for what is no such file at all.

/// MCAP (the specification of version 0): chunks of no compression, lz4 or zstd. Neither the index
/// nor the summary is needed.
std::unique_ptr<BagFile> scan_mcap(const std::filesystem::path& path,
                                   std::uint32_t file,
                                   BagContent& content);
/// A bag of ROS 1 ("Bags/Format/2.0" of its documentation): chunks of no compression, bz2 or lz4.
/// The index is not needed.
std::unique_ptr<BagFile> scan_ros1_bag(const std::filesystem::path& path,
                                       std::uint32_t file,
                                       BagContent& content);
/// SQLite of rosbag2.
std::unique_ptr<BagFile> scan_sqlite_bag(const std::filesystem::path& path,
                                         std::uint32_t file,
                                         BagContent& content);

/// A recording of ROS: a .mcap, .db3 or .bag file, or the folder of a bag of ROS 2 with the files
/// that its metadata.yaml lists, or that it holds.
class Bag {
 public:
  /// Scans all of it. Throws InputError for what is no bag, or one that is compressed as a whole.
  explicit Bag(const std::filesystem::path& path);

  const BagContent& content() const { return content_; }
  /// For people: "ROS 1 bag", "ROS 2 bag (MCAP)", ...
  const std::string& title() const { return title_; }
  const std::vector<std::filesystem::path>& files() const { return paths_; }
  /// The bytes of a message. Throws InputError when they are damaged or gone.
  std::string read(const BagMessage& message);

 private:
  std::string title_;
  std::vector<std::filesystem::path> paths_;
  std::vector<std::unique_ptr<BagFile>> files_;
  BagContent content_;
};

/// Whether a file begins as one of a bag does.
bool is_bag_file(const std::filesystem::path& path);
/// Whether a folder is a bag of ROS 2: it holds metadata.yaml, or files of bags and nothing else
/// that makes a data set.
bool is_bag_folder(const std::filesystem::path& folder);

}  // namespace waymark
