// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Feature extraction, ours and cv::ORB, on the same images: the first of euroc_mh01_stereo in the
// folder WAYMARK_DATA, else one of synthetic texture.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "waymark/image/extractor.h"

namespace {

constexpr std::size_t kMaxImages = 20;

cv::Mat make_texture() {
  cv::Mat image(480, 752, CV_8U);
  cv::RNG random(1);
  image = cv::Scalar(96);
  for (int i = 0; i < 1500; ++i) {
    const cv::Point corner(random.uniform(0, image.cols), random.uniform(0, image.rows));
    const cv::Size size(random.uniform(4, 40), random.uniform(4, 40));
    image(cv::Rect(corner, size) & cv::Rect({0, 0}, image.size())) =
        cv::Scalar(random.uniform(0, 256));
  }
  return image;
}

std::vector<std::filesystem::path> recorded_images() {
  const char* data = std::getenv("WAYMARK_DATA");
  if (data == nullptr) return {};
  const auto folder = std::filesystem::path(data) / "euroc_mh01_stereo/mav0/cam0/data";
  if (!std::filesystem::is_directory(folder)) return {};
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".png") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  paths.resize(std::min(paths.size(), kMaxImages));
  return paths;
}

const std::vector<cv::Mat>& images() {
  static const std::vector<cv::Mat> all = [] {
    std::vector<cv::Mat> loaded;
    for (const std::filesystem::path& path : recorded_images()) {
      loaded.push_back(cv::imread(path.string(), cv::IMREAD_GRAYSCALE));
    }
    if (loaded.empty()) loaded.push_back(make_texture());
    return loaded;
  }();
  return all;
}

waymark::ImageView view(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
}

void BM_Extractor(benchmark::State& state) {
  waymark::FeatureExtractor extractor({.count = static_cast<int>(state.range(0))});
  std::vector<waymark::Keypoint> keypoints;
  std::vector<waymark::Descriptor> descriptors;
  std::size_t i = 0;
  for (auto _ : state) {
    extractor.extract(view(images()[i++ % images().size()]), {}, keypoints, descriptors);
  }
}
BENCHMARK(BM_Extractor)->Arg(1000)->Arg(2000)->Unit(benchmark::kMillisecond);

void BM_OpenCvOrb(benchmark::State& state) {
  cv::setNumThreads(1);
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(static_cast<int>(state.range(0)), 1.2f, 8);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  std::size_t i = 0;
  for (auto _ : state) {
    orb->detectAndCompute(images()[i++ % images().size()], cv::noArray(), keypoints, descriptors);
  }
}
BENCHMARK(BM_OpenCvOrb)->Arg(1000)->Arg(2000)->Unit(benchmark::kMillisecond);

void BM_Pyramid(benchmark::State& state) {
  waymark::Pyramid pyramid;
  for (auto _ : state) pyramid.build(view(images()[0]));
}
BENCHMARK(BM_Pyramid)->Unit(benchmark::kMicrosecond);

}  // namespace
