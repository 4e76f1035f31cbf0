// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/calibrate/image_circle.h"
#include "waymark/calibrate/model_selection.h"
#include "waymark/camera/registry.h"
#include "waymark/image/convert.h"
#include "waymark/system/system.h"

namespace waymark {
namespace {

constexpr std::size_t kStretchFrames = 300;
constexpr int kMaxStretches = 4;
constexpr std::size_t kMinFrames = 15;
/// Larger images are made smaller, which costs hardly any accuracy and bounds memory and time.
constexpr double kMaxPixels = 6e5;
/// An image that is seen further off its centre than this was taken by a fisheye lens.
constexpr double kFisheyeRad = 70.0 * kRadiansPerDegree;
constexpr int kMaxRounds = 4;
/// Two maps of the same frames differ by about this much in the focal length.
constexpr double kRepeatability = 0.004;
/// Smaller maps tell nothing.
constexpr std::size_t kMinKeyframes = 5;
constexpr std::size_t kMinLandmarks = 100;
constexpr double kSure = 0.03;
/// How far a focal length may be off, relatively: any, by a data sheet, that of most cameras.
constexpr double kAnyFocalLength = 1.0;
constexpr double kByDataSheet = 0.05;
constexpr double kOfMost = 0.3;

/// Images of camera 0 in order, reduced.
struct Stretch {
  std::vector<Image> images;
  std::vector<Image> masks;  ///< As many; empty where everything is used.
  double factor = 1.0;       ///< Of their size.
  int width_px = 0;          ///< As they were.
  int height_px = 0;
};

bool is_stopped(const CalibrateOptions& options) {
  return options.should_stop && options.should_stop();
}

/// InputError for images of a size that no camera has.
void check_size(int width_px, int height_px) {
  CameraRegistry::with_builtin_models().make_camera(
      make_lens(LensModel::kPerspective, width_px, width_px, height_px));
}

Stretch read_stretch(Input& input, const CalibrateOptions& options) {
  Stretch stretch;
  while (stretch.images.size() < kStretchFrames && !is_stopped(options)) {
    std::optional<InputFrame> frame = input.next();
    if (!frame) break;
    if (frame->images.empty()) continue;
    Image& image = frame->images.front();
    stretch.width_px = image.width_px;
    stretch.height_px = image.height_px;
    if (stretch.images.empty()) check_size(image.width_px, image.height_px);
    const double pixels = static_cast<double>(image.values.size());
    stretch.factor = std::min(1.0, std::sqrt(kMaxPixels / pixels));
    stretch.images.push_back(stretch.factor < 1.0 ? reduce(image.view(), stretch.factor)
                                                  : std::move(image));
    Image mask = frame->mask ? *std::move(frame->mask) : Image();
    if (frame->mask && stretch.factor < 1.0) mask = pick_reduced(mask.view(), stretch.factor);
    stretch.masks.push_back(std::move(mask));
  }
  return stretch;
}

/// Some images, spread over the stretch.
std::vector<Image> samples_of(const Stretch& stretch) {
  constexpr std::size_t kNumSamples = 20;
  std::vector<Image> samples;
  const std::size_t step = std::max<std::size_t>(1, stretch.images.size() / kNumSamples);
  for (std::size_t i = 0; i < stretch.images.size(); i += step) {
    samples.push_back(stretch.images[i]);
  }
  return samples;
}

/// What is known of the lens before it moves.
struct AssumedLens {
  LensModel model = LensModel::kPerspective;
  bool has_circle = false;
  CameraDescription description;  ///< Principal point and size; any focal length.
};

AssumedLens look_at(const Stretch& stretch) {
  const std::vector<Image> samples = samples_of(stretch);
  const int width = samples.front().width_px;
  const int height = samples.front().height_px;
  AssumedLens assumed;
  if (are_equirectangular(samples)) assumed.model = LensModel::kEquirectangular;
  const auto circle = find_image_circle(samples);
  assumed.has_circle = assumed.model == LensModel::kPerspective && circle.has_value();
  if (assumed.has_circle) assumed.model = LensModel::kFisheye;
  const double focal_px = assumed.has_circle ? circle->radius_px / (0.5 * std::numbers::pi) : width;
  assumed.description = make_lens(assumed.model, focal_px, width, height);
  if (assumed.has_circle) {
    assumed.description.intrinsics[2] = circle->center_px.x();
    assumed.description.intrinsics[3] = circle->center_px.y();
  }
  return assumed;
}

/// How far off the axis the corner of the image is seen.
double corner_angle(const DivisionLens& lens, const CameraDescription& size) {
  const double radius =
      0.5 * std::hypot(size.width_px, size.height_px) / lens.focal_px(size.width_px);
  return std::atan2(radius, 1.0 + lens.division * radius * radius);
}

/// What a map tells of a lens.
struct MappedLens {
  CameraDescription description;
  LensChange sigmas = LensChange::Zero();
  std::size_t num_keyframes = 0;
};

/// How far the truth may lie from a lens that is likely.
CalibrationSigmas sigmas_around(const CameraDescription& lens, double focal_sigma) {
  const LensChange sigmas = lens_sigmas(lens.width_px, focal_sigma);
  CalibrationSigmas of_camera;
  for (const std::size_t i : {0u, 1u}) {
    of_camera.intrinsics.push_back(focal_sigma * lens.intrinsics[i]);
  }
  of_camera.intrinsics.insert(of_camera.intrinsics.end(), {sigmas[2], sigmas[3]});
  of_camera.distortion_coeffs = {sigmas[4], sigmas[5], 0.0, 0.0};
  return of_camera;
}

/// The estimates of a run as numbers of a lens.
MappedLens lens_of(const System& system) {
  MappedLens lens{*system.rig()->cameras[0].description, {}, system.map()->keyframes().size()};
  const std::vector<CalibrationEstimate> estimates = system.calibration();
  constexpr std::array<const char*, 6> kNames = {
      "cam0.fu", "cam0.fv", "cam0.pu", "cam0.pv", "cam0.k1", "cam0.k2"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto told = std::ranges::find(estimates, kNames[i], &CalibrationEstimate::name);
    lens.sigmas[static_cast<Eigen::Index>(i)] = told == estimates.end() ? HUGE_VAL : told->sigma;
  }
  lens.sigmas[0] /= lens.description.intrinsics[0];
  lens.sigmas[1] = lens_sigmas(lens.description.width_px, 1.0)[1];
  return lens;
}

/// Maps a stretch as far as it goes, the lens along with it. Nothing where the map is too small.
std::optional<MappedLens> map_stretch(const Stretch& stretch,
                                      const CameraDescription& lens,
                                      double focal_sigma,
                                      const CalibrateOptions& options) {
  Settings settings;
  settings.seed = options.seed;
  settings.calibration.refine = "on";
  CameraChain chain;
  chain.cameras.push_back({lens, Rigid3(), 0.0, sigmas_around(lens, focal_sigma)});
  System system(make_rig(chain), settings, Timing::kInline);
  for (std::size_t i = 0; i < stretch.images.size() && !is_stopped(options); ++i) {
    FrameImages frame;
    frame.timestamp_ns = static_cast<std::int64_t>(i) * 1'000'000'000 / 30;
    frame.image0 = stretch.images[i].view();
    frame.mask = stretch.masks[i].view();
    system.feed(frame);
  }
  system.finish();
  const Map& map = *system.map();
  if (map.keyframes().size() < kMinKeyframes || map.landmarks().size() < kMinLandmarks) {
    return std::nullopt;
  }
  return lens_of(system);
}

/// Maps with what the map before told, until the focal length stays.
std::optional<MappedLens> refine_by_mapping(const Stretch& stretch,
                                            CameraDescription lens,
                                            double focal_sigma,
                                            const CalibrateOptions& options) {
  std::optional<MappedLens> refined;
  double change = 1.0;
  for (int round = 0; round < kMaxRounds && !is_stopped(options); ++round) {
    auto next = map_stretch(stretch, lens, focal_sigma, options);
    if (!next) break;
    change = std::abs(std::log(next->description.intrinsics[0] / lens.intrinsics[0]));
    lens = next->description;
    refined = std::move(next);
    if (options.on_progress) {
      options.on_progress(fmt::format("calibration: round {}: focal length {:.1f} px",
                                      round + 1,
                                      lens.intrinsics[0] / stretch.factor));
    }
    if (change < kRepeatability) break;
  }
  if (refined) {
    refined->sigmas[0] = std::hypot(refined->sigmas[0], std::max(change, kRepeatability));
  }
  return refined;
}

EstimatedCalibration full_size(const Stretch& stretch, const CameraDescription& lens) {
  EstimatedCalibration calibration;
  calibration.camera = enlarged(lens, 1.0 / stretch.factor, stretch.width_px, stretch.height_px);
  calibration.fov_deg =
      horizontal_fov_rad(*make_if_possible(calibration.camera)) / kRadiansPerDegree;
  calibration.num_frames = stretch.images.size();
  return calibration;
}

EstimatedCalibration calibrate_stretch(const Stretch& stretch, const CalibrateOptions& options) {
  AssumedLens assumed = look_at(stretch);
  if (assumed.model == LensModel::kEquirectangular) {
    EstimatedCalibration calibration = full_size(stretch, assumed.description);
    calibration.model = assumed.model;
    calibration.is_sure = true;
    calibration.reason = "twice as wide as high, and the left border goes on at the right one";
    return calibration;
  }
  std::optional<double> known_fov_rad;
  if (options.fov_deg) known_fov_rad = *options.fov_deg * kRadiansPerDegree;
  const std::vector<PixelMatches> pairs =
      match_stretch(stretch.images, stretch.masks, assumed.description);
  const DivisionLens found = find_division_lens(pairs, assumed.description, known_fov_rad);
  if (corner_angle(found, assumed.description) > kFisheyeRad) assumed.model = LensModel::kFisheye;
  const CameraDescription lens = with_coefficients(assumed.model,
                                                   found.focal_px(assumed.description.width_px),
                                                   found.division,
                                                   assumed.description);
  const double focal_sigma = known_fov_rad ? kByDataSheet : kAnyFocalLength;
  const auto refined = refine_by_mapping(stretch, lens, focal_sigma, options);
  EstimatedCalibration calibration = full_size(stretch, refined ? refined->description : lens);
  calibration.model = assumed.model;
  calibration.reason = "the motion does not tell, the likeliest is taken";
  calibration.sigmas = lens_sigmas(calibration.camera.width_px, kOfMost);
  if (!refined) return calibration;
  calibration.num_keyframes = refined->num_keyframes;
  calibration.sigmas = refined->sigmas;
  calibration.sigmas.segment<2>(2) /= stretch.factor;
  calibration.is_sure = refined->sigmas[0] < kSure;
  if (calibration.is_sure) calibration.reason = "the motion tells";
  return calibration;
}

}  // namespace

CameraChain EstimatedCalibration::chain() const {
  CameraChain chain;
  ChainCamera& estimated = chain.cameras.emplace_back(ChainCamera{camera, Rigid3()});
  if (camera.intrinsics.empty() || !sigmas.allFinite()) return chain;
  estimated.sigmas.intrinsics = {sigmas[0] * camera.intrinsics[0],
                                 std::hypot(sigmas[0], sigmas[1]) * camera.intrinsics[1],
                                 sigmas[2],
                                 sigmas[3]};
  // The others are not looked for.
  const double other = model == LensModel::kFisheye ? 0.01 : 5e-4;
  estimated.sigmas.distortion_coeffs = {sigmas[4], sigmas[5], other, other};
  return chain;
}

std::string describe(const EstimatedCalibration& calibration) {
  if (calibration.model == LensModel::kEquirectangular) {
    return fmt::format("360 degree images: {}", calibration.reason);
  }
  return fmt::format("{}, focal length {:.1f} px (+- {:.1f} %), {:.0f} degrees wide: {}",
                     to_string(calibration.model),
                     calibration.camera.intrinsics[0],
                     100.0 * calibration.sigmas[0],
                     calibration.fov_deg,
                     calibration.reason);
}

std::vector<std::string> report(const EstimatedCalibration& calibration) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("model: {}", to_string(calibration.model)));
  lines.push_back(fmt::format("why: {}", calibration.reason));
  if (calibration.model == LensModel::kEquirectangular) return lines;
  const std::vector<double>& numbers = calibration.camera.intrinsics;
  const std::vector<double>& distortion = calibration.camera.distortion_coeffs;
  const LensChange& sigmas = calibration.sigmas;
  lines.push_back(fmt::format("focal length: {:.1f} px +- {:.1f} px ({:.1f} %)",
                              numbers[0],
                              sigmas[0] * numbers[0],
                              100.0 * sigmas[0]));
  lines.push_back(fmt::format("field of view: {:.1f} degrees wide", calibration.fov_deg));
  if (calibration.num_keyframes == 0) return lines;
  lines.push_back(fmt::format(
      "pixels: {:.4f} times as high as wide +- {:.4f}", numbers[0] / numbers[1], sigmas[1]));
  lines.push_back(fmt::format("principal point: {:.1f}, {:.1f} px +- {:.1f}, {:.1f} px",
                              numbers[2],
                              numbers[3],
                              sigmas[2],
                              sigmas[3]));
  lines.push_back(fmt::format("distortion: k1 {:.4f} +- {:.4f}, k2 {:.4f} +- {:.4f}",
                              distortion[0],
                              sigmas[4],
                              distortion[1],
                              sigmas[5]));
  lines.push_back(fmt::format(
      "from: {} keyframes of {} frames", calibration.num_keyframes, calibration.num_frames));
  return lines;
}

EstimatedCalibration calibrate(Input& input, const CalibrateOptions& options) {
  std::optional<EstimatedCalibration> best;
  const int num_stretches = input.info().is_live ? 1 : kMaxStretches;
  for (int i = 0; i < num_stretches && !is_stopped(options); ++i) {
    if (options.on_progress) {
      options.on_progress(fmt::format("calibration: not known yet, looking at {} frames{}",
                                      kStretchFrames,
                                      i == 0 ? "" : " more"));
    }
    const Stretch stretch = read_stretch(input, options);
    if (stretch.images.empty() || (best && stretch.images.size() < kMinFrames)) break;
    EstimatedCalibration next = calibrate_stretch(stretch, options);
    if (!best || next.sigmas[0] < best->sigmas[0]) best = std::move(next);
    if (best->is_sure) break;
  }
  if (!best) throw InputError("calibration", "there is no image, expected some");
  return *best;
}

}  // namespace waymark
