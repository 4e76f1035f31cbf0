// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Each usual mistake is made of a good sequence and named; the good sequence is left in peace.
#include "waymark/session/calibration_monitor.h"

#include <gmock/gmock.h>

#include <cmath>
#include <memory>
#include <thread>

#include "waymark/session/calibration_advice.h"
#include "waymark/session/session.h"
#include "waymark/session/testing/memory_input.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MemoryInput;
using ::testing::Not;

constexpr double kUnitsPerMetre = 1000.0;

CameraDescription watched_camera(double shift_px) {
  CameraDescription camera = named_camera("perspective", 240);
  for (double& intrinsic : camera.intrinsics) intrinsic += shift_px;
  return camera;
}

/// Camera 1 to the right, turned outwards, and not like camera 0.
CameraChain watched_pair() {
  return stereo_chain(watched_camera(0.0),
                      watched_camera(3.0),
                      {so3_exp({0.01, -0.03, 0.005}), {-0.12, 0.003, 0.002}});
}

CameraChain watched_depth() { return rgbd_chain(watched_camera(0.0), kUnitsPerMetre); }

std::vector<InputFrame> render(SequenceSpec spec) {
  spec.effects.noise_sigma = 2.0;
  SimulatedSequence sequence(spec, std::thread::hardware_concurrency());
  std::vector<InputFrame> frames(static_cast<std::size_t>(spec.num_frames));
  for (int i = 0; i < spec.num_frames; ++i) {
    SimulatedFrame simulated = sequence.frame(i);
    InputFrame& frame = frames[static_cast<std::size_t>(i)];
    frame.index = static_cast<std::size_t>(i);
    frame.timestamp_ns = simulated.timestamp_ns;
    frame.images = std::move(simulated.images);
    if (spec.chain.depth_factor) frame.depth = std::move(simulated.depth);
  }
  return frames;
}

std::vector<InputFrame> render(const CameraChain& chain, const char* world, int num_frames) {
  SequenceSpec spec;
  spec.chain = chain;
  spec.world = world;
  spec.motion = world == std::string("room") ? "slide" : "loop";
  spec.num_frames = num_frames;
  return render(std::move(spec));
}

const std::vector<InputFrame>& pair_frames() {
  static const std::vector<InputFrame> frames = render(watched_pair(), "room", 11);
  return frames;
}

/// What a session names that is told the chain.
std::vector<std::string> mistakes_of(const std::vector<InputFrame>& frames,
                                     const CameraChain& told) {
  auto input = std::make_unique<MemoryInput>(frames);
  input->info().calibration = told;
  input->info().setup = told.cameras.size() > 1 ? Setup::kStereo
                        : told.depth_factor     ? Setup::kRgbd
                                                : Setup::kMono;
  PreparedInput prepared{std::move(input), {}, make_rig(told), {}, {}};
  prepared.settings.features.count = 500;
  if (told.depth_factor) prepared.settings.depth.factor = *told.depth_factor;
  std::vector<std::string> heard;
  CalibrationMonitor watch(prepared, [&](const std::string& line) { heard.push_back(line); });
  System system(prepared.rig, prepared.settings, Timing::kInline);
  SessionHooks hooks;
  hooks.watch = &watch;
  const SessionResults results = run_session(*prepared.input, system, hooks);
  EXPECT_EQ(results.summary.mistakes, heard);
  return heard;
}

CameraChain with_transform(CameraChain chain, const Rigid3& cam1_from_cam0) {
  chain.cameras[1].cam_from_rig = cam1_from_cam0;
  return chain;
}

TEST(CalibrationMonitor, LeavesRightPairsInPeace) {
  EXPECT_THAT(mistakes_of(pair_frames(), watched_pair()), IsEmpty());
}

TEST(CalibrationMonitor, NamesSwappedImages) {
  std::vector<InputFrame> frames = pair_frames();
  for (InputFrame& frame : frames) std::swap(frame.images[0], frame.images[1]);
  EXPECT_THAT(mistakes_of(frames, watched_pair()),
              ElementsAre(AllOf(HasSubstr("not to the right of camera 0"),
                                HasSubstr("left and right images are swapped?"))));
}

TEST(CalibrationMonitor, NamesInverseTransforms) {
  const Rigid3 right = watched_pair().cameras[1].cam_from_rig;
  EXPECT_THAT(mistakes_of(pair_frames(), with_transform(watched_pair(), right.inverse())),
              ElementsAre(AllOf(HasSubstr("not to the left of camera 0"),
                                HasSubstr("expected its inverse"),
                                Not(HasSubstr("swapped")))));
  EXPECT_THAT(mistakes_of(pair_frames(),
                          with_transform(watched_pair(), {right.rotation, -right.translation})),
              ElementsAre(HasSubstr("wrong sign")));
}

TEST(CalibrationMonitor, NamesBothWhereTheyAreTheSame) {
  const CameraChain rectified = stereo_chain(
      watched_camera(0.0), watched_camera(0.0), Rigid3({1.0, 0.0, 0.0, 0.0}, {-0.12, 0.0, 0.0}));
  std::vector<InputFrame> frames = render(rectified, "room", 1);
  EXPECT_THAT(mistakes_of(frames, rectified), IsEmpty());
  for (InputFrame& frame : frames) std::swap(frame.images[0], frame.images[1]);
  EXPECT_THAT(mistakes_of(frames, rectified),
              ElementsAre(AllOf(HasSubstr("swapped"), HasSubstr("inverse"))));
}

TEST(CalibrationMonitor, NamesPairsThatDoNotFit) {
  const Rigid3 right = watched_pair().cameras[1].cam_from_rig;
  const Rigid3 turned = Rigid3(so3_exp({0.03, 0.0, 0.0}), Eigen::Vector3d::Zero()) * right;
  EXPECT_THAT(mistakes_of(pair_frames(), with_transform(watched_pair(), turned)),
              ElementsAre(HasSubstr("camera 1 shows only")));
  EXPECT_THAT(
      mistakes_of(pair_frames(),
                  with_transform(watched_pair(), {right.rotation, 1000.0 * right.translation})),
      ElementsAre(HasSubstr("is T_cn_cnm1 in millimetres?")));
}

TEST(CalibrationMonitor, NamesUnitsOfDepth) {
  const std::vector<InputFrame> frames = render(watched_depth(), "room", 3);
  EXPECT_THAT(mistakes_of(frames, watched_depth()), IsEmpty());
  for (const double factor : {0.05, 20.0, 1000.0}) {
    CameraChain told = watched_depth();
    *told.depth_factor *= factor;
    EXPECT_THAT(mistakes_of(frames, told), ElementsAre(HasSubstr("is depth.factor right?")))
        << factor;
  }
}

TEST(DepthCheck, NamesDepthThatIsNotRegistered) {
  const std::vector<InputFrame> frames = render(watched_depth(), "hall", 10);
  DepthCheck good;
  DepthCheck shifted;
  for (const InputFrame& frame : frames) {
    good.add(frame.images[0].view(), frame.depth->view());
    DepthImage moved(frame.depth->width_px, frame.depth->height_px);
    for (int y = 0; y < moved.height_px; ++y) {
      std::copy(frame.depth->row(y) + 16, frame.depth->row(y) + moved.width_px, moved.row(y));
    }
    shifted.add(frame.images[0].view(), moved.view());
  }
  EXPECT_EQ(good.advise_on_registration(), std::nullopt);
  EXPECT_THAT(shifted.advise_on_registration().value_or(""),
              HasSubstr("moved by 16 px to the right and 0 px down and enlarged by 1"));
}

TEST(CalibrationMonitor, NamesTimesInOtherUnits) {
  std::vector<InputFrame> frames = testing::small_frames(4);
  for (InputFrame& frame : frames) frame.images[0] = Image(32, 32);
  const CameraChain chain = mono_chain({"pinhole", {32, 32, 16, 16}, "none", {}, 32, 32, "test"});
  EXPECT_THAT(mistakes_of(frames, chain), IsEmpty());
  for (const double factor : {1e3, 1e-3, 1e-6}) {
    std::vector<InputFrame> wrong = frames;
    for (std::size_t i = 0; i < wrong.size(); ++i) {
      // As if every third image were used.
      wrong[i].index = 3 * i;
      wrong[i].timestamp_ns = std::llround(factor * 1e8 * static_cast<double>(3 * i));
    }
    EXPECT_THAT(mistakes_of(wrong, chain),
                ElementsAre(HasSubstr(factor == 1e-3 ? "microseconds?" : "milliseconds?")))
        << factor;
  }
}

TEST(CalibrationAdvice, NamesUnlikelyNumbers) {
  for (const std::string& name : camera_names()) {
    EXPECT_THAT(advise_on_numbers(mono_chain(named_camera(name, 480))), IsEmpty()) << name;
  }
  CameraDescription camera = named_camera("perspective", 480);
  for (double& intrinsic : camera.intrinsics) intrinsic *= 2.0;
  EXPECT_THAT(
      advise_on_numbers(mono_chain(camera)),
      ElementsAre(AllOf(HasSubstr("about 1279x959 px"), HasSubstr("multiply them by 0.5"))));
  camera = named_camera("perspective", 480);
  camera.intrinsics[0] = camera.intrinsics[1] = 4.2;
  EXPECT_THAT(advise_on_numbers(mono_chain(camera)), ElementsAre(HasSubstr("millimetres?")));
  // Cut off at the top, as images of cars are.
  camera = named_camera("perspective", 480);
  camera.intrinsics[3] -= 100.0;
  EXPECT_THAT(advise_on_numbers(mono_chain(camera)), IsEmpty());
}

}  // namespace
}  // namespace waymark
