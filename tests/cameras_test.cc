// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Every camera model and set-up, on simulated images, against the exact truth.
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "simulated_run.h"
#include "waymark/simulate/named_cameras.h"

namespace waymark {
namespace {

constexpr int kNumCameraFrames = 60;
constexpr int kCameraHeightPx = 300;

struct CameraCase {
  const char* camera;
  Setup setup;
  double max_ate_m;
  double verged_rad = 0.0;
};

void PrintTo(const CameraCase& test, std::ostream* stream) { *stream << test.camera; }

CameraChain make_chain(const CameraCase& test) {
  const CameraDescription camera = named_camera(test.camera, kCameraHeightPx);
  if (test.setup == Setup::kMono) return mono_chain(camera);
  if (test.setup == Setup::kRgbd) return rgbd_chain(camera, kDepthFactor);
  Vector6d cam1_from_cam0;
  cam1_from_cam0 << -0.15, 0.002, -0.001, 0.0, test.verged_rad, 0.0;
  return stereo_chain(camera, camera, Rigid3::exp(cam1_from_cam0));
}

/// The bounds are about twice what was measured.
class CameraAccuracy : public ::testing::TestWithParam<CameraCase> {};

TEST_P(CameraAccuracy, IsAsStatedAndRepeats) {
  const CameraCase& test = GetParam();
  SequenceSpec spec = small_sequence(test.setup, kNumCameraFrames);
  spec.chain = make_chain(test);
  const Recording recording = simulate(spec);
  const SessionResults results = map_recording(recording, Timing::kLockstep);
  EXPECT_EQ(coverage(results), 1.0);
  const double ate_m = evaluate_results(results, recording).ate_m.rmse;
  RecordProperty("ate_mm", std::to_string(1000.0 * ate_m));
  EXPECT_LT(ate_m, test.max_ate_m);
  EXPECT_EQ(hash_of(map_recording(recording, Timing::kInline)), hash_of(results));
}

std::string name_of(const ::testing::TestParamInfo<CameraCase>& info) {
  return std::string(info.param.camera) + "_" + std::string(to_string(info.param.setup)) +
         (info.param.verged_rad > 0.0 ? "_verged" : "");
}

INSTANTIATE_TEST_SUITE_P(Mono,
                         CameraAccuracy,
                         ::testing::Values(CameraCase{"perspective", Setup::kMono, 0.02},
                                           CameraCase{"fisheye", Setup::kMono, 0.02},
                                           CameraCase{"fisheye_200", Setup::kMono, 0.03},
                                           CameraCase{"equirectangular", Setup::kMono, 0.01},
                                           CameraCase{"omni", Setup::kMono, 0.02},
                                           CameraCase{"eucm", Setup::kMono, 0.02},
                                           CameraCase{"ds", Setup::kMono, 0.02},
                                           CameraCase{"division", Setup::kMono, 0.02}),
                         name_of);

INSTANTIATE_TEST_SUITE_P(Stereo,
                         CameraAccuracy,
                         ::testing::Values(CameraCase{"perspective", Setup::kStereo, 0.008},
                                           CameraCase{"fisheye", Setup::kStereo, 0.008},
                                           CameraCase{"fisheye", Setup::kStereo, 0.008, 0.1745},
                                           CameraCase{"equirectangular", Setup::kStereo, 0.008}),
                         name_of);

INSTANTIATE_TEST_SUITE_P(Rgbd,
                         CameraAccuracy,
                         ::testing::Values(CameraCase{"perspective", Setup::kRgbd, 0.008},
                                           CameraCase{"fisheye", Setup::kRgbd, 0.008}),
                         name_of);

}  // namespace
}  // namespace waymark
