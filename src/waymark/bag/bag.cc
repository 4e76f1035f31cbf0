// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/bag.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/config_value.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

struct BagFormat {
  std::string_view start;  ///< Of the file.
  const char* title;
  std::unique_ptr<BagFile> (*scan)(const std::filesystem::path&, std::uint32_t, BagContent&);
};

constexpr std::array kBagFormats = {
    BagFormat{{"\x89MCAP", 5}, "ROS bag (MCAP)", scan_mcap},
    BagFormat{"#ROSBAG V", "ROS 1 bag", scan_ros1_bag},
    BagFormat{{"SQLite format 3\0", 16}, "ROS 2 bag (SQLite)", scan_sqlite_bag},
};
constexpr const char* kMetadata = "metadata.yaml";
constexpr const char* kBagInformation = "rosbag2_bagfile_information";

/// Null for a file that is none.
const BagFormat* format_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return nullptr;
  std::array<char, 16> bytes = {};
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), bytes.size());
  const std::string_view start(bytes.data(), static_cast<std::size_t>(stream.gcount()));
  const auto found = std::ranges::find_if(
      kBagFormats, [&](const BagFormat& format) { return start.starts_with(format.start); });
  return found == kBagFormats.end() ? nullptr : &*found;
}

bool has_bag_name(const std::filesystem::path& path) {
  return path.extension() == ".mcap" || path.extension() == ".db3" || path.extension() == ".bag";
}

/// The files that a folder holds, by name: bag_0.mcap, ..., bag_10.mcap.
std::vector<std::filesystem::path> list_bag_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (has_bag_name(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files, [](const auto& a, const auto& b) {
    const std::string a_name = a.filename().string();
    const std::string b_name = b.filename().string();
    return a_name.size() != b_name.size() ? a_name.size() < b_name.size() : a_name < b_name;
  });
  return files;
}

/// Of "walk_0.mcap", one of the parts of a recording, "walk.mcap".
std::string name_of_whole(const std::filesystem::path& file) {
  std::string stem = file.stem().string();
  const std::size_t last = stem.find_last_not_of("0123456789");
  if (last != std::string::npos && stem[last] == '_') stem.resize(last);
  return stem + file.extension().string();
}

[[noreturn]] void fail_compressed(const std::string& where, const std::string& file) {
  throw InputError(where,
                   fmt::format("is compressed as a whole, expected a plain bag: decompress it, for "
                               "example zstd -d {}",
                               file));
}

/// The files of a folder in order, as metadata.yaml lists them.
std::vector<std::filesystem::path> read_metadata(const std::filesystem::path& folder,
                                                 std::vector<std::string>& faults) {
  const std::filesystem::path path = folder / kMetadata;
  const ConfigNode root = parse_config(ConfigSource::from_file(path));
  const ConfigNode* information =
      root.kind == ConfigNode::Kind::kMap ? root.find(kBagInformation) : nullptr;
  const ConfigNode* names = information && information->kind == ConfigNode::Kind::kMap
                                ? information->find("relative_file_paths")
                                : nullptr;
  if (names == nullptr || names->kind != ConfigNode::Kind::kList) {
    throw InputError(path.string(), "has no relative_file_paths, expected that of a bag of ROS 2");
  }
  const ConfigNode* mode = information->find("compression_mode");
  if (mode != nullptr && config_string(*mode, "compression_mode") == "MESSAGE") {
    throw InputError(mode->where(),
                     "messages are compressed one by one, expected a bag without that: ros2 bag "
                     "convert, or record with an mcap preset");
  }
  std::vector<std::filesystem::path> files;
  for (const ConfigNode& node : names->items) {
    const std::filesystem::path name = config_string(node, "relative_file_paths");
    if (name.extension() == ".zstd") fail_compressed((folder / name).string(), name.string());
    // Bags are moved and renamed: the folder is where the list is.
    const std::filesystem::path file = folder / name.filename();
    if (std::filesystem::exists(file)) {
      files.push_back(file);
    } else {
      faults.push_back(fmt::format("{}: missing, left out", file.string()));
    }
  }
  return files;
}

std::vector<std::filesystem::path> files_of(const std::filesystem::path& path,
                                            std::vector<std::string>& faults) {
  if (!std::filesystem::is_directory(path)) return {path};
  std::vector<std::filesystem::path> files;
  if (std::filesystem::exists(path / kMetadata)) files = read_metadata(path, faults);
  if (files.empty()) files = list_bag_files(path);
  if (files.empty()) throw InputError(path.string(), "holds no bag, expected .mcap, .db3 or .bag");
  const auto is_part = [&](const auto& file) {
    return name_of_whole(file) == name_of_whole(files.front());
  };
  if (!std::ranges::all_of(files, is_part)) {
    throw InputError(path.string(),
                     fmt::format("holds {} bags, expected one: name the file", files.size()));
  }
  return files;
}

}  // namespace

Bag::Bag(const std::filesystem::path& path) {
  paths_ = files_of(path, content_.faults);
  for (const std::filesystem::path& file : paths_) {
    const BagFormat* format = format_of(file);
    if (file.extension() == ".zstd") fail_compressed(file.string(), file.filename().string());
    if (format == nullptr) {
      throw InputError(file.string(), "is no bag, expected MCAP, SQLite of ROS 2, or ROS 1");
    }
    title_ = format->title;
    files_.push_back(format->scan(file, static_cast<std::uint32_t>(files_.size()), content_));
  }
}

std::string Bag::read(const BagMessage& message) {
  return files_.at(message.place.file)->read(message.place);
}

bool is_bag_file(const std::filesystem::path& path) {
  return has_bag_name(path) || path.extension() == ".zstd" || format_of(path) != nullptr;
}

bool is_bag_folder(const std::filesystem::path& folder) {
  std::string line;
  if (std::error_code error; std::filesystem::is_regular_file(folder / kMetadata, error)) {
    std::ifstream stream(folder / kMetadata);
    std::getline(stream, line);
  }
  return line.starts_with(kBagInformation) || !list_bag_files(folder).empty();
}

}  // namespace waymark
