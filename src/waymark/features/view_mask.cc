// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/view_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "waymark/features/brief.h"
#include "waymark/features/pyramid.h"

namespace waymark {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// The lower envelope of parabolas (section 2.1): values[i] becomes the least of
/// values[k] + (i - k)^2. Those of infinite height never count.
class LineTransform {
 public:
  explicit LineTransform(std::size_t length) : apexes_(length), ends_(length), result_(length) {}

  void apply(float* values, std::size_t length, std::size_t stride) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < length; ++i) {
      const float height = values[i * stride];
      if (height == kFar) continue;
      while (count > 0 && meeting(values, stride, apexes_[count - 1], i) <= start(count - 1)) {
        --count;
      }
      if (count > 0) ends_[count - 1] = meeting(values, stride, apexes_[count - 1], i);
      apexes_[count++] = i;
    }
    if (count == 0) return;
    std::size_t k = 0;
    for (std::size_t i = 0; i < length; ++i) {
      while (k + 1 < count && ends_[k] < static_cast<double>(i)) ++k;
      const double apart = static_cast<double>(i) - static_cast<double>(apexes_[k]);
      result_[i] = values[apexes_[k] * stride] + static_cast<float>(apart * apart);
    }
    for (std::size_t i = 0; i < length; ++i) values[i * stride] = result_[i];
  }

 private:
  /// Where the parabola of k begins to be the lowest.
  double start(std::size_t k) const {
    return k == 0 ? -std::numeric_limits<double>::infinity() : ends_[k - 1];
  }
  static double meeting(const float* values, std::size_t stride, std::size_t a, std::size_t b) {
    const double p = static_cast<double>(a), q = static_cast<double>(b);
    return (values[b * stride] - values[a * stride] + q * q - p * p) / (2.0 * (q - p));
  }

  std::vector<std::size_t> apexes_;
  std::vector<double> ends_;
  std::vector<float> result_;
};

/// Lenses with a visible image circle show more than this at the corners of the image.
constexpr double kWideRad = std::numbers::pi / 3.0;
/// Surroundings are darker than this, save for this share of a ring's pixels.
constexpr int kBlack = 20;
constexpr double kMaxBrightShare = 0.02;
constexpr int kMaxBrightPixels = 2;
/// The edge of the circle is as soft as this.
constexpr double kSoftEdgePx = 2.0;
/// A smaller circle, relative to the largest in the image, is a dark scene.
constexpr double kMinCircle = 0.5;
/// Surroundings of fewer rings are no circle's.
constexpr int kMinRings = 4;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// 1 where a pixel fulfils the test of its bearing, else 0; empty if all do.
template <class Test>
Image test_bearings(const Camera& camera, Test test) {
  Image result(camera.width_px(), camera.height_px());
  std::vector<Eigen::Vector2d> pixels(static_cast<std::size_t>(camera.width_px()));
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  bool are_all = true;
  for (int y = 0; y < camera.height_px(); ++y) {
    for (std::size_t x = 0; x < pixels.size(); ++x) pixels[x] = {static_cast<double>(x), y};
    camera.unproject(pixels, bearings, is_valid);
    for (std::size_t x = 0; x < pixels.size(); ++x) {
      const bool is_good = test(is_valid[x] ? &bearings[x] : nullptr);
      result.row(y)[x] = is_good;
      are_all = are_all && is_good;
    }
  }
  return are_all ? Image() : result;
}

Image directions_in_use(const Camera& camera, const ViewSettings& settings) {
  const ViewSettings unlimited;
  if (settings.max_angle_deg >= unlimited.max_angle_deg && settings.top_deg <= 0.0 &&
      settings.bottom_deg <= 0.0) {
    return {};
  }
  const double min_z = std::cos(settings.max_angle_deg * kRadPerDeg);
  const double min_y = -std::cos(settings.top_deg * kRadPerDeg);
  const double max_y = std::cos(settings.bottom_deg * kRadPerDeg);
  return test_bearings(camera, [&](const Eigen::Vector3d* bearing) {
    return bearing == nullptr ||
           (bearing->z() >= min_z && bearing->y() >= min_y && bearing->y() <= max_y);
  });
}

bool is_wide(const Camera& camera) {
  if (camera.wrap_width_px() > 0.0) return false;
  const double right = camera.width_px() - 1.0, bottom = camera.height_px() - 1.0;
  const std::vector<Eigen::Vector2d> corners = {
      {0.0, 0.0}, {right, 0.0}, {0.0, bottom}, {right, bottom}};
  std::vector<Eigen::Vector3d> bearings(4);
  std::vector<std::uint8_t> is_valid(4);
  camera.unproject(corners, bearings, is_valid);
  for (std::size_t i = 0; i < 4; ++i) {
    if (!is_valid[i] || bearings[i].z() < std::cos(kWideRad)) return true;
  }
  return false;
}

/// Radius of the smallest circle outside of which the image is black; beyond the corners if it is
/// not.
double lit_radius(ImageView image, const Eigen::Vector2d& center) {
  std::vector<int> num_pixels, num_bright;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      const auto ring = static_cast<std::size_t>(std::hypot(x - center.x(), y - center.y()));
      if (ring >= num_pixels.size()) {
        num_pixels.resize(ring + 1, 0);
        num_bright.resize(ring + 1, 0);
      }
      ++num_pixels[ring];
      num_bright[ring] += image.at(x, y) > kBlack;
    }
  }
  std::size_t end = num_pixels.size();
  while (end > 0 && num_bright[end - 1] <=
                        std::max<double>(kMaxBrightPixels, kMaxBrightShare * num_pixels[end - 1])) {
    --end;
  }
  return end + kMinRings > num_pixels.size() ? INFINITY : static_cast<double>(end);
}

/// The levels, all of them if empty, or 0 where the mask is 0. Keeps the buffer.
void combine(ImageView levels, ImageView mask, Image& result) {
  if (result.values.empty()) result = Image(mask.width_px, mask.height_px);
  for (int y = 0; y < mask.height_px; ++y) {
    const std::uint8_t* const allowed = levels.is_empty() ? nullptr : levels.row(y);
    for (int x = 0; x < mask.width_px; ++x) {
      const std::uint8_t count = allowed ? allowed[x] : Pyramid::kNumLevels;
      result.row(y)[x] = mask.at(x, y) == 0 ? 0 : count;
    }
  }
}

/// Where a camera sees straight ahead; the centre of the image if it does not.
Eigen::Vector2d principal_point(const Camera& camera) {
  const Eigen::Vector3d ahead(0.0, 0.0, 1.0);
  Eigen::Vector2d pixel;
  std::uint8_t is_visible = 0;
  camera.project({&ahead, 1}, {&pixel, 1}, {&is_visible, 1});
  if (is_visible) return pixel;
  return {0.5 * camera.width_px() - 0.5, 0.5 * camera.height_px() - 0.5};
}

}  // namespace

std::vector<float> distances_to_zero(ImageView image) {
  const auto width = static_cast<std::size_t>(image.width_px);
  const auto height = static_cast<std::size_t>(image.height_px);
  std::vector<float> squared(width * height);
  for (std::size_t i = 0; i < squared.size(); ++i) {
    const int x = static_cast<int>(i % width), y = static_cast<int>(i / width);
    squared[i] = image.at(x, y) == 0 ? 0.0f : kFar;
  }
  LineTransform columns(height);
  for (std::size_t x = 0; x < width; ++x) columns.apply(squared.data() + x, height, width);
  LineTransform rows(width);
  for (std::size_t y = 0; y < height; ++y) rows.apply(squared.data() + y * width, width, 1);
  for (float& value : squared) value = std::sqrt(value);
  return squared;
}

ImageView LevelMask::combined_with(ImageView other, Image& buffer) const {
  const ImageView limits = is_empty() ? ImageView() : num_levels_->view();
  if (other.is_empty()) return limits;
  combine(limits, other, buffer);
  return buffer.view();
}

bool LevelMask::allows(const Eigen::Vector2d& pixel, int level) const {
  if (is_empty()) return true;
  const int x = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, num_levels_->width_px - 1);
  const int y = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, num_levels_->height_px - 1);
  return num_levels_->view().at(x, y) > level;
}

ViewMask::ViewMask(std::shared_ptr<const Camera> camera, const ViewSettings& settings)
    : camera_(std::move(camera)),
      center_px_(principal_point(*camera_)),
      may_have_circle_(is_wide(*camera_)),
      has_bearing_(test_bearings(*camera_, [](const Eigen::Vector3d* b) { return b != nullptr; })),
      is_direction_(directions_in_use(*camera_, settings)),
      ego_(camera_) {
  update();
}

void ViewMask::learn(ImageView image) {
  if (!is_learning()) return;
  ++num_learned_;
  const double radius = lit_radius(image, center_px_);
  if (radius < kMinCircle * 0.5 * std::min(image.width_px, image.height_px)) return;
  if (radius <= circle_radius_px_) return;
  circle_radius_px_ = radius;
  update();
}

void ViewMask::watch(const LocatedImage& located, bool is_same_world) {
  if (!is_same_world) ego_.restart();
  const ImageView levels = lens_levels_.values.empty() ? ImageView() : lens_levels_.view();
  if (ego_.watch(located, levels)) exclude_ego();
}

void ViewMask::exclude_ego() {
  const Image& mask = ego_.mask();
  if (!mask.values.empty()) {
    Image num_levels;
    combine(lens_levels_.view(), mask.view(), num_levels);
    levels_ = LevelMask(std::move(num_levels));
  } else {
    levels_ = lens_levels_.values.empty() ? LevelMask() : LevelMask(lens_levels_);
  }
}

void ViewMask::update() {
  lens_levels_ = Image();
  const bool has_circle = circle_radius_px_ > 0.0 && std::isfinite(circle_radius_px_);
  const bool has_surroundings = has_circle || !has_bearing_.values.empty();
  if (!has_surroundings && is_direction_.values.empty()) return exclude_ego();
  lens_levels_ = Image(camera_->width_px(), camera_->height_px());
  Image is_scene = has_bearing_;
  if (is_scene.values.empty()) {
    is_scene = Image(camera_->width_px(), camera_->height_px());
    std::fill(is_scene.values.begin(), is_scene.values.end(), std::uint8_t{1});
  }
  for (int y = 0; has_circle && y < is_scene.height_px; ++y) {
    for (int x = 0; x < is_scene.width_px; ++x) {
      const double radius = std::hypot(x - center_px_.x(), y - center_px_.y());
      if (radius > circle_radius_px_ - kSoftEdgePx) is_scene.row(y)[x] = 0;
    }
  }
  const std::vector<float> distances = distances_to_zero(is_scene.view());
  for (std::size_t i = 0; i < distances.size(); ++i) {
    int count = 0;
    while (count < Pyramid::kNumLevels && distances[i] > kBriefRadius * Pyramid::scale(count)) {
      ++count;
    }
    if (!is_direction_.values.empty() && is_direction_.values[i] == 0) count = 0;
    lens_levels_.values[i] = static_cast<std::uint8_t>(count);
  }
  exclude_ego();
}

}  // namespace waymark
