// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/pairing.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

/// A sub-folder with images, or a video.
struct Part {
  std::string name;
  std::size_t num_images = 0;
};

constexpr int kMaxDepth = 5;
constexpr std::size_t kMaxFolders = 1000;

/// By name.
std::vector<std::filesystem::path> sub_folders(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> folders;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (folders.size() < kMaxFolders && entry->is_directory(error))
      folders.push_back(entry->path());
  }
  std::ranges::sort(folders);
  return folders;
}

std::vector<Part> parts_of(const std::filesystem::path& folder, bool are_videos) {
  std::vector<Part> parts;
  if (are_videos) {
    for (const auto& video : list_videos(folder)) parts.push_back({video.filename().string(), 0});
    return parts;
  }
  // Folders of the level that is nearest of those that hold images.
  std::vector<std::filesystem::path> level = sub_folders(folder);
  for (int depth = 0; depth < kMaxDepth && parts.empty(); ++depth) {
    std::vector<std::filesystem::path> next;
    for (const std::filesystem::path& sub_folder : level) {
      const std::size_t count = count_images(sub_folder);
      if (count > 0) parts.push_back({sub_folder.lexically_relative(folder).string(), count});
      for (auto& below : sub_folders(sub_folder)) next.push_back(std::move(below));
      if (next.size() > kMaxFolders) break;
    }
    level = std::move(next);
  }
  return parts;
}

std::string describe(const std::vector<Part>& parts, bool are_videos) {
  constexpr std::size_t kMaxNamed = 4;
  std::string names;
  std::string counts;
  bool is_same = true;
  for (std::size_t i = 0; i < std::min(parts.size(), kMaxNamed); ++i) {
    const bool is_last = i + 1 == parts.size();
    const char* separator = i == 0 ? "" : is_last ? " and " : ", ";
    names += fmt::format("{}{}{}", separator, printable(parts[i].name), are_videos ? "" : "/");
    counts += fmt::format("{}{}", separator, parts[i].num_images);
    is_same = is_same && parts[i].num_images == parts.front().num_images;
  }
  if (parts.size() > kMaxNamed) names += ", ...";
  if (are_videos) return fmt::format("holds {} videos, {}", parts.size(), names);
  if (parts.size() > kMaxNamed) return fmt::format("holds no image itself, but {} do", names);
  if (parts.size() == 1) {
    return fmt::format("holds no image itself, but {} holds {} images", names, counts);
  }
  return is_same ? fmt::format("holds no image itself, but {} hold {} images each",
                               names,
                               parts.front().num_images)
                 : fmt::format("holds no image itself, but {} hold {} images", names, counts);
}

}  // namespace

Partners partners_by_name(const std::vector<std::filesystem::path>& images,
                          const std::vector<std::filesystem::path>& others) {
  std::map<std::string, std::size_t> by_stem;
  for (std::size_t i = 0; i < others.size(); ++i) by_stem.emplace(others[i].stem().string(), i);
  Partners partners;
  bool has_any = false;
  for (const std::filesystem::path& image : images) {
    const auto found = by_stem.find(image.stem().string());
    partners.push_back(found == by_stem.end() ? std::nullopt : std::optional(found->second));
    has_any = has_any || partners.back();
  }
  if (has_any) return partners;
  if (images.size() != others.size()) {
    throw InputError(others.front().parent_path().string(),
                     fmt::format("{} images, none of the name of one of the {} of {}, expected the "
                                 "same names or as many",
                                 others.size(),
                                 images.size(),
                                 images.front().parent_path().string()));
  }
  for (std::size_t i = 0; i < images.size(); ++i) partners[i] = i;
  return partners;
}

Partners partners_by_time(const std::vector<std::int64_t>& times_ns,
                          const std::vector<std::int64_t>& others_ns) {
  return pair_depth(times_ns, others_ns, median_step_ns(times_ns) / 2);
}

void add_partners(Listing& listing,
                  const Partners& partners,
                  const std::vector<std::filesystem::path>& others,
                  const std::vector<std::int64_t>& others_ns,
                  const std::string& where) {
  const bool is_stereo = listing.setup == Setup::kStereo;
  const auto has_partner = [](const auto& partner) { return partner.has_value(); };
  const auto num_pairs = static_cast<std::size_t>(std::ranges::count_if(partners, has_partner));
  if (2 * num_pairs < partners.size()) {
    throw InputError(where,
                     fmt::format("{} of {} frames have a partner in it, expected at least half "
                                 "(or --setup mono)",
                                 num_pairs,
                                 partners.size()));
  }
  for (std::size_t i = 0; i < partners.size(); ++i) {
    if (!partners[i]) continue;
    ListedFrame& frame = listing.frames[i];
    (is_stereo ? frame.images.emplace_back() : frame.depth) = others[*partners[i]];
    if (is_stereo || others_ns.empty()) continue;
    frame.depth_lag_ns = others_ns[*partners[i]] - frame.timestamp_ns;
  }
  const auto first = std::ranges::find_if(partners, has_partner) - partners.begin();
  listing.frames.erase(listing.frames.begin(), listing.frames.begin() + first);
  if (first > 0)
    listing.notes.push_back(
        fmt::format("note: {} frames before the first pair are left out", first));
  listing.counts.without_partner = listing.frames.size() - num_pairs;
  if (!is_stereo) {
    listing.notes.push_back(
        fmt::format("{} of {} colour images have depth", num_pairs, listing.frames.size()));
  } else if (listing.counts.without_partner > 0) {
    listing.notes.push_back(
        fmt::format("note: {} frames have no image of camera 1 and are used without",
                    listing.counts.without_partner));
  }
}

std::vector<std::size_t> keep_increasing(Listing& listing,
                                         const std::vector<std::int64_t>& times_ns,
                                         const std::string& where) {
  std::vector<std::size_t> used = increasing_times(times_ns, where, "images");
  const std::size_t num_left_out = times_ns.size() - used.size();
  listing.counts.out_of_order += num_left_out;
  if (num_left_out > 0)
    listing.notes.push_back(describe_out_of_order(num_left_out, "images of " + where));
  return used;
}

bool are_left_and_right(const std::string& left, const std::string& right) {
  if (const auto at = left.find("left"); at != std::string::npos) {
    std::string other = left;
    return other.replace(at, 4, "right") == right;
  }
  if (left.size() != right.size()) return false;
  const auto [a, b] = std::ranges::mismatch(left, right);
  if (a == left.end() ||
      std::string_view(a + 1, left.end()) != std::string_view(b + 1, right.end()))
    return false;
  const bool is_alone = a + 1 == left.end() || !is_digit(a[1]);
  return is_alone && ((*a == '0' && *b == '1') || (*a == '1' && *b == '2'));
}

std::string suggest_command(const std::filesystem::path& folder, bool are_videos) {
  const std::vector<Part> parts = parts_of(folder, are_videos);
  if (parts.empty()) return "";
  const std::string found = describe(parts, are_videos);
  const auto path_of = [&](const Part& part) { return (folder / part.name).string(); };
  for (const Part& left : parts) {
    for (const Part& right : parts) {
      if (!are_left_and_right(left.name, right.name)) continue;
      return fmt::format(
          "{}: for a stereo pair say waymark run {} {}", found, path_of(left), path_of(right));
    }
  }
  const auto is_depth = [](const Part& part) {
    return part.name.find("depth") != std::string::npos;
  };
  const auto depth = std::ranges::find_if(parts, is_depth);
  if (!are_videos && parts.size() == 2 && depth != parts.end()) {
    const Part& colour = parts[depth == parts.begin() ? 1 : 0];
    return fmt::format("{}: for colour with depth say waymark run {} --depth {}",
                       found,
                       path_of(colour),
                       path_of(*depth));
  }
  return fmt::format("{}, expected one: for example waymark run {}", found, path_of(parts.front()));
}

}  // namespace waymark
