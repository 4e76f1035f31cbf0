// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Time of our feature extractor relative to cv::ORB on the images of a folder:
//   waymark_feature_ratio FOLDER [COUNT [MAX_IMAGES]]
// Of more than MAX_IMAGES as many are used, evenly spread.
// Both work on each image in turn, on one thread. Times are those that the thread had the
// processor, so that other load on the machine hits neither, or both alike.

#include <time.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "waymark/image/extractor.h"

namespace {

double thread_time_ms() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

template <class Work>
double milliseconds(Work work) {
  const double start = thread_time_ms();
  work();
  return thread_time_ms() - start;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".png") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::vector<std::filesystem::path> spread(const std::vector<std::filesystem::path>& all,
                                          std::size_t max_count) {
  if (all.size() <= max_count) return all;
  std::vector<std::filesystem::path> chosen;
  for (std::size_t i = 0; i < max_count; ++i) chosen.push_back(all[i * all.size() / max_count]);
  return chosen;
}

nlohmann::json measure(const std::vector<std::filesystem::path>& paths, int count) {
  waymark::FeatureExtractor ours({.count = count});
  const cv::Ptr<cv::ORB> theirs = cv::ORB::create(count, 1.2f, 8);
  std::vector<waymark::Keypoint> keypoints;
  std::vector<waymark::Descriptor> descriptors;
  std::vector<cv::KeyPoint> cv_keypoints;
  cv::Mat cv_descriptors;
  std::vector<double> ours_ms;
  std::vector<double> theirs_ms;
  std::vector<double> returned;
  for (const std::filesystem::path& path : paths) {
    const cv::Mat image = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
    if (image.empty()) throw std::runtime_error(path.string() + ": cannot be read as an image");
    const waymark::ImageView view{
        image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
    ours_ms.push_back(milliseconds([&] { ours.extract(view, {}, keypoints, descriptors); }));
    theirs_ms.push_back(milliseconds(
        [&] { theirs->detectAndCompute(image, cv::noArray(), cv_keypoints, cv_descriptors); }));
    returned.push_back(static_cast<double>(keypoints.size()) / count);
  }
  return {{"images", paths.size()},
          {"count", count},
          {"ours_ms", median(ours_ms)},
          {"cv_orb_ms", median(theirs_ms)},
          {"ratio", median(ours_ms) / median(theirs_ms)},
          {"returned_fraction", *std::min_element(returned.begin(), returned.end())}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: waymark_feature_ratio FOLDER [COUNT [MAX_IMAGES]]\n";
    return 2;
  }
  try {
    cv::setNumThreads(1);
    std::vector<std::filesystem::path> paths = list_images(argv[1]);
    const int count = argc > 2 ? std::stoi(argv[2]) : 1000;
    if (argc > 3) paths = spread(paths, std::stoul(argv[3]));
    if (paths.empty()) throw std::runtime_error(std::string(argv[1]) + ": no PNG images");
    std::cout << measure(paths, count).dump(2) << "\n";
  } catch (const std::exception& error) {
    std::cerr << "waymark_feature_ratio: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
