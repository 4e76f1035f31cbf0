// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Time of our feature extractor relative to cv::ORB on the images of a folder or video:
//   waymark_feature_ratio FOLDER|VIDEO [COUNT [MAX_IMAGES]]
// Of more than MAX_IMAGES (200) as many are used, evenly spread.
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
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/features/extractor.h"

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

std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".png") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// Of the indices below count at most max_count, evenly spread.
std::vector<std::size_t> spread(std::size_t count, std::size_t max_count) {
  std::vector<std::size_t> chosen;
  const std::size_t num_chosen = std::min(count, max_count);
  for (std::size_t i = 0; i < num_chosen; ++i) chosen.push_back(i * count / num_chosen);
  return chosen;
}

std::vector<cv::Mat> read_folder(const std::filesystem::path& folder, std::size_t max_count) {
  const std::vector<std::filesystem::path> paths = list_images(folder);
  if (paths.empty()) throw std::runtime_error(folder.string() + ": no PNG images");
  std::vector<cv::Mat> images;
  for (const std::size_t i : spread(paths.size(), max_count)) {
    images.push_back(cv::imread(paths[i].string(), cv::IMREAD_GRAYSCALE));
    if (images.back().empty()) {
      throw std::runtime_error(paths[i].string() + ": cannot be read as an image");
    }
  }
  return images;
}

/// Grey frames of a video.
std::vector<cv::Mat> read_video(const std::filesystem::path& path, std::size_t max_count) {
  cv::VideoCapture capture(path.string());
  const auto num_frames = static_cast<std::size_t>(capture.get(cv::CAP_PROP_FRAME_COUNT));
  const std::vector<std::size_t> chosen = spread(num_frames, max_count);
  std::vector<cv::Mat> images;
  cv::Mat frame;
  for (std::size_t i = 0; images.size() < chosen.size() && capture.grab(); ++i) {
    if (i != chosen[images.size()] || !capture.retrieve(frame)) continue;
    images.emplace_back();
    cv::cvtColor(frame, images.back(), cv::COLOR_BGR2GRAY);
  }
  if (images.empty()) throw std::runtime_error(path.string() + ": no frames");
  return images;
}

nlohmann::json measure(const std::vector<cv::Mat>& images, int count) {
  waymark::FeatureExtractor ours({.count = count});
  const cv::Ptr<cv::ORB> theirs = cv::ORB::create(count, 1.2f, 8);
  std::vector<waymark::Keypoint> keypoints;
  std::vector<waymark::Descriptor> descriptors;
  std::vector<cv::KeyPoint> cv_keypoints;
  cv::Mat cv_descriptors;
  std::vector<double> ours_ms;
  std::vector<double> theirs_ms;
  std::vector<double> returned;
  for (const cv::Mat& image : images) {
    const waymark::ImageView view{
        image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
    ours_ms.push_back(milliseconds([&] { ours.extract(view, {}, keypoints, descriptors); }));
    theirs_ms.push_back(milliseconds(
        [&] { theirs->detectAndCompute(image, cv::noArray(), cv_keypoints, cv_descriptors); }));
    returned.push_back(static_cast<double>(keypoints.size()) / count);
  }
  return {{"images", images.size()},
          {"count", count},
          {"ours_ms", waymark::median(ours_ms)},
          {"cv_orb_ms", waymark::median(theirs_ms)},
          {"ratio", waymark::median(ours_ms) / waymark::median(theirs_ms)},
          {"returned_fraction", *std::min_element(returned.begin(), returned.end())}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: waymark_feature_ratio FOLDER|VIDEO [COUNT [MAX_IMAGES]]\n";
    return 2;
  }
  try {
    cv::setNumThreads(1);
    const std::filesystem::path path = argv[1];
    const int count = argc > 2 ? std::stoi(argv[2]) : 1000;
    const std::size_t max_count = argc > 3 ? std::stoul(argv[3]) : 200;
    const bool is_folder = std::filesystem::is_directory(path);
    const auto images = is_folder ? read_folder(path, max_count) : read_video(path, max_count);
    std::cout << measure(images, count).dump(2) << "\n";
  } catch (const std::exception& error) {
    std::cerr << "waymark_feature_ratio: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
