// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/base/time_column.h"
#include "waymark/input/datasets.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

constexpr std::int64_t kMaxDepthDifferenceNs = 20'000'000;
/// Units per metre, as the benchmark defines its files (Sturm et al. 2012).
constexpr double kDepthFactor = 5000.0;

std::size_t nearest(const std::vector<std::int64_t>& times_ns, std::int64_t time_ns) {
  const auto after = std::lower_bound(times_ns.begin(), times_ns.end(), time_ns);
  const std::size_t index = static_cast<std::size_t>(after - times_ns.begin());
  if (index == times_ns.size()) return index - 1;
  if (index > 0 && time_ns - times_ns[index - 1] <= times_ns[index] - time_ns) return index - 1;
  return index;
}

std::vector<std::int64_t> times_of(const std::vector<TumImage>& images) {
  std::vector<std::int64_t> times_ns;
  for (const TumImage& image : images) times_ns.push_back(image.timestamp_ns);
  return times_ns;
}

/// The images of a list, as far as their times increase.
std::vector<TumImage> read_tum_images(const std::filesystem::path& path, Listing& listing) {
  const std::string text = read_text_file(path, "the image list of a TUM RGB-D data set");
  const std::vector<TumImage> images = parse_tum_images(text, path.string());
  std::vector<TumImage> used;
  for (const std::size_t i : keep_increasing(listing, times_of(images), path.string())) {
    used.push_back(images[i]);
  }
  return used;
}

}  // namespace

std::vector<TumImage> parse_tum_images(std::string_view text, const std::string& name) {
  std::vector<TumImage> images;
  const TimeColumn column(text, ' ');
  RowReader rows(text, name, ' ');
  while (rows.next()) {
    rows.expect_exactly(2, "2: seconds and file name");
    TumImage image{column.read(rows), rows.relative_path(1)};
    images.push_back(std::move(image));
  }
  if (images.empty()) throw InputError(name, "empty, expected rows of seconds and file name");
  return images;
}

std::vector<std::optional<std::size_t>> pair_depth(const std::vector<std::int64_t>& colour_ns,
                                                   const std::vector<std::int64_t>& depth_ns,
                                                   std::int64_t max_difference_ns) {
  std::vector<std::optional<std::size_t>> pairs(colour_ns.size());
  if (depth_ns.empty()) return pairs;
  for (std::size_t i = 0; i < colour_ns.size(); ++i) {
    const std::size_t depth = nearest(depth_ns, colour_ns[i]);
    const bool is_near = std::abs(depth_ns[depth] - colour_ns[i]) <= max_difference_ns;
    if (is_near && nearest(colour_ns, depth_ns[depth]) == i) pairs[i] = depth;
  }
  return pairs;
}

Listing list_tum_rgbd(const std::filesystem::path& folder, const InputOptions& options) {
  const bool has_depth = std::filesystem::exists(folder / "depth.txt");
  std::vector<Setup> offered = {Setup::kMono};
  if (has_depth) offered.push_back(Setup::kRgbd);

  Listing listing;
  listing.format = "tum";
  listing.title = "TUM RGB-D";
  listing.setup = choose_setup(folder, offered, options.setup);
  const std::vector<TumImage> colour = read_tum_images(folder / "rgb.txt", listing);
  for (const TumImage& image : colour) {
    listing.frames.push_back({image.timestamp_ns, {folder / image.name}, {}});
  }
  if (listing.setup != Setup::kRgbd) return listing;

  const std::vector<TumImage> depth = read_tum_images(folder / "depth.txt", listing);
  const auto pairs = pair_depth(times_of(colour), times_of(depth), kMaxDepthDifferenceNs);
  std::size_t num_pairs = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!pairs[i]) continue;
    listing.frames[i].depth = folder / depth[*pairs[i]].name;
    listing.frames[i].depth_lag_ns = depth[*pairs[i]].timestamp_ns - colour[i].timestamp_ns;
    ++num_pairs;
  }
  if (num_pairs == 0) {
    throw InputError(
        (folder / "depth.txt").string(),
        "no depth image within 0.02 s of a colour image, expected pairs (or --setup mono)");
  }
  listing.depth_factor = kDepthFactor;
  listing.counts.without_partner = colour.size() - num_pairs;
  listing.notes.push_back(
      fmt::format("{} of {} colour images have depth", num_pairs, colour.size()));
  return listing;
}

}  // namespace waymark
