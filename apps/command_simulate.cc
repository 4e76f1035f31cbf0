// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "commands.h"
#include "numbers.h"
#include "paths.h"
#include "reporter.h"
#include "simulated_chain.h"
#include "terminal.h"
#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/text.h"
#include "waymark/exchange/export_folder.h"
#include "waymark/simulate/dataset.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/named_rigs.h"
#include "waymark/simulate/sequence.h"

namespace waymark {
namespace {

/// Makes frames black but for the sensor's noise: of all cameras, or of one.
void blacken(int first, int count, std::optional<std::size_t> camera, SequenceSpec& spec) {
  ImageEffects black = spec.effects;
  black.gain = 0.0;
  spec.spans.insert(spec.spans.begin(), {first, first + count, black, camera});
}

void blacken(const std::vector<int>& firsts_and_counts, SequenceSpec& spec) {
  if (firsts_and_counts.size() % 2 != 0) {
    throw InputError("--black", "ends with a first frame, expected FIRST,COUNT,...");
  }
  for (std::size_t i = 0; i < firsts_and_counts.size(); i += 2) {
    blacken(firsts_and_counts[i], firsts_and_counts[i + 1], {}, spec);
  }
}

void darken(const std::vector<int>& cameras_firsts_and_counts, SequenceSpec& spec) {
  if (cameras_firsts_and_counts.size() % 3 != 0) {
    throw InputError("--dark", "ends early, expected CAMERA,FIRST,COUNT,...");
  }
  const std::size_t num_cameras = spec.chain.cameras.size();
  for (std::size_t i = 0; i < cameras_firsts_and_counts.size(); i += 3) {
    const auto camera = static_cast<std::size_t>(cameras_firsts_and_counts[i]);
    if (camera >= num_cameras) {
      throw InputError("--dark",
                       fmt::format("names camera {}, expected one below {}", camera, num_cameras));
    }
    blacken(cameras_firsts_and_counts[i + 1], cameras_firsts_and_counts[i + 2], camera, spec);
  }
}

struct SimulateOptions {
  std::string name;  ///< Of a world, or of a sequence of the suite.
  std::filesystem::path out;
  std::string camera;  ///< Camchain file or name; empty: the default.
  std::string rig;     ///< A name in place of camera and setup; empty: these.
  Setup setup = Setup::kStereo;
  SequenceSpec spec;
  double exposure_ms = 0.0;
  double readout_ms = 0.0;
  double depth_lag_ms = 0.0;
  double trigger_lag_ms = 0.0;
  double stitched_m = 0.0;
  double stabilised_share = 0.0;
  double compressed_kbit_per_s = 0.0;
  std::vector<double> turn_deg;   ///< Of camera 1; empty: none.
  std::vector<double> warped_px;  ///< Along and across the epipolar lines; empty: none.
  std::vector<double> gain1;      ///< Of camera 1, in the first frame and the last; empty: 1.
  std::vector<std::string> told;  ///< KEY=VALUE each.
  std::vector<std::string> imu;   ///< Name, then KEY=VALUE each; empty: none.
  std::vector<int> black;         ///< First frame and number of frames, by turns.
  std::vector<int> dark;          ///< Camera, first frame and number of frames, by turns.
  bool is_list = false;
  bool is_quiet = false;
};

SequenceSpec plain_spec_of(const SimulateOptions& options) {
  const std::vector<std::string> worlds = world_names();
  if (std::find(worlds.begin(), worlds.end(), options.name) == worlds.end()) {
    for (SuiteEntry& entry : simulated_suite()) {
      if (entry.spec.name == options.name) return entry.spec;
    }
    throw InputError(fmt::format("world '{}'", options.name),
                     "is unknown, expected one that waymark simulate --list names");
  }
  SequenceSpec spec = options.spec;
  spec.name = spec.world = options.name;
  spec.effects.exposure_s = 1e-3 * options.exposure_ms;
  spec.chain = options.rig.empty() ? simulated_chain(options.camera, options.setup)
                                   : named_rig(options.rig, kSimulatedHeightPx);
  return spec;
}

/// With what goes for worlds and for sequences of the suite alike.
SequenceSpec spec_of(const SimulateOptions& options) {
  SequenceSpec spec = plain_spec_of(options);
  spec.readout_s = 1e-3 * options.readout_ms;
  spec.depth_lag_s = 1e-3 * options.depth_lag_ms;
  spec.trigger_lag_s = 1e-3 * options.trigger_lag_ms;
  spec.stitched_m = options.stitched_m;
  spec.stabilised_share = options.stabilised_share;
  spec.compressed_kbit_per_s = options.compressed_kbit_per_s;
  if (!options.warped_px.empty()) spec.warped_px = Eigen::Vector2d(options.warped_px.data());
  if (!options.gain1.empty()) spec.gain1 = Eigen::Vector2d(options.gain1.data());
  turn_camera1(options.turn_deg, spec.chain);
  if (!options.imu.empty()) spec.imu = parse_imu(options.imu);
  blacken(options.black, spec);
  darken(options.dark, spec);
  spec.told = parse_calibration_error(options.told);
  // What cannot be told fails before anything is written.
  make_rig(told_chain(spec.chain, spec.told));
  told_imu(spec.imu ? spec.imu->calibration() : ImuCalibration{}, spec.told);
  return spec;
}

int list_choices() {
  for (const std::string& world : world_names()) print_result("world {}\n", world);
  for (const std::string& motion : motion_names()) print_result("motion {}\n", motion);
  for (const std::string& camera : camera_names()) print_result("camera {}\n", camera);
  for (const std::string& rig : rig_names()) print_result("rig {}\n", rig);
  for (const std::string& imu : imu_names()) print_result("imu {}\n", imu);
  for (const SuiteEntry& entry : simulated_suite()) {
    print_result("sequence {} {} {}\n", entry.spec.name, entry.setup, entry.about);
  }
  return kDone;
}

int simulate(const SimulateOptions& options) {
  if (options.is_list) return list_choices();
  if (options.name.empty() || options.out.empty()) {
    throw InputError("command line", "WORLD and --out are missing, expected both or --list");
  }
  Reporter reporter(options.is_quiet ? Verbosity::kQuiet : Verbosity::kNormal, {});
  SimulatedSequence sequence(spec_of(options), std::max(1u, std::thread::hardware_concurrency()));
  ExportFolder folder(options.out);
  if (folder.is_again()) reporter.info(options.out.string() + ": the earlier one is replaced");
  const auto num_frames = static_cast<std::size_t>(sequence.num_frames());
  try {
    write_dataset(sequence, folder.unfinished(), [&](int frame) {
      reporter.progress(static_cast<std::size_t>(frame) + 1, num_frames, "rendering");
    });
  } catch (const OutputError& error) {  // It names a folder that is gone by then.
    throw OutputError(options.out.string(), std::string("cannot be made: ") + error.what());
  }
  folder.finish();
  reporter.finish_progress();
  reporter.info(fmt::format(
      "{} of {} in {}", count_of(num_frames, "frame"), options.name, options.out.string()));
  return kDone;
}

void add_population_options(CLI::App& simulation, SequenceSpec& spec) {
  simulation
      .add_option("--walkers",
                  spec.num_walkers,
                  "People who cross the view at any time; 3 hide up to half of it")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  simulation.add_flag("--operator",
                      spec.has_operator,
                      "Somebody who carries the camera on a pole above the head, seen below it");
  simulation
      .add_option("--changes",
                  spec.num_changes,
                  "Cupboards that are gone and doors that are open in the second half")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  simulation
      .add_option("--markers",
                  spec.num_markers,
                  "Square markers on the walls (tag36h11), with their sizes and true poses in "
                  "markers.yaml")
      ->check(CLI::Range(0, 500))
      ->capture_default_str();
}

/// Flaws of camera 1 of a pair.
void add_pair_options(CLI::App& simulation, SimulateOptions& options) {
  simulation
      .add_option("--turn",
                  options.turn_deg,
                  "X,Y,Z: degrees that camera 1 of a pair is turned about its own axes [0,0,0]")
      ->delimiter(',')
      ->expected(3)
      ->check(number_between(-180.0, 180.0));
  simulation
      .add_option("--warped",
                  options.warped_px,
                  "ALONG,ACROSS: pixels that images of camera 1 of a pair are bent by at most, "
                  "along and across the epipolar lines, as rectification leaves them [0,0]")
      ->delimiter(',')
      ->expected(2)
      ->check(number_between(0.0, 100.0));
  simulation
      .add_option("--gain",
                  options.gain1,
                  "FIRST,LAST: factors by which camera 1 of a pair is brighter than camera 0, in "
                  "the first frame and in the last [1,1]")
      ->delimiter(',')
      ->expected(2)
      ->check(number_between(0.01, 100.0));
}

void add_flaw_options(CLI::App& simulation, SimulateOptions& options) {
  simulation
      .add_option("--readout",
                  options.readout_ms,
                  "Milliseconds from the first row to the last: a rolling shutter [0]")
      ->check(number_between(0.0, 1000.0));
  simulation
      .add_option("--depth-lag",
                  options.depth_lag_ms,
                  "Milliseconds that depth images are taken after the others [0]")
      ->check(number_between(0.0, 1000.0));
  simulation
      .add_option("--trigger-lag",
                  options.trigger_lag_ms,
                  "Milliseconds that each camera is exposed after the one before it [0]")
      ->check(number_between(0.0, 1000.0));
  simulation
      .add_option("--stitched",
                  options.stitched_m,
                  "Metres between the two lenses that 360 degree images are stitched from [0]")
      ->check(number_between(0.0, 1.0));
  simulation
      .add_option("--stabilised",
                  options.stabilised_share,
                  "Part of its width by which the picture is shifted at most, to hide how the "
                  "camera shakes; 0.05 is usual [0]")
      ->check(number_between(0.0, 0.2));
  simulation
      .add_option("--compressed",
                  options.compressed_kbit_per_s,
                  "Kilobits per second that each camera's images are compressed to, as H.264 [not]")
      ->check(number_between(1.0, 1e6));
  simulation
      .add_option("--black",
                  options.black,
                  "FIRST,COUNT,...: frames that are black, as many from each first one on [none]")
      ->delimiter(',')
      ->check(CLI::Range(0, 1000000));
  simulation
      .add_option("--dark",
                  options.dark,
                  "CAMERA,FIRST,COUNT,...: frames in which one camera is black [none]")
      ->delimiter(',')
      ->check(CLI::Range(0, 1000000));
  add_pair_options(simulation, options);
}

void add_imu_options(CLI::App& simulation, SimulateOptions& options) {
  reads(simulation
            .add_option("--imu",
                        options.imu,
                        "NAME[,KEY=VALUE,...]: samples of an inertial measurement unit, see "
                        "--list [none]")
            ->delimiter(','));
  simulation
      .add_option("--told",
                  options.told,
                  "KEY=VALUE,...: write a calibration that is off; factors focal, distortion, "
                  "baseline, depth; centre in px; turn_x, turn_y, turn_z of camera 1 in "
                  "mrad; imu_turn in degrees, imu_lever in cm, imu_shift in ms; imu=none [the "
                  "true one]")
      ->delimiter(',');
}

}  // namespace

void add_simulate_command(CLI::App& program, Command& command) {
  const auto options = std::make_shared<SimulateOptions>();
  SequenceSpec& spec = options->spec;
  spec.effects.noise_sigma = 2.0;
  CLI::App& simulation =
      *program.add_subcommand("simulate", "Images with exact ground truth, as a data set");
  simulation.add_option(
      "WORLD", options->name, "A world, or a sequence of the evaluation suite; see --list");
  writes(simulation.add_option("-o,--out", options->out, "Folder for the data set"));
  reads(simulation.add_option(
      "--camera",
      options->camera,
      "Camchain file, or a name, see --list [640x480 pinhole, a pair 11 cm apart]"));
  add_choice<Setup>(simulation,
                    "--setup",
                    options->setup,
                    {{"mono", Setup::kMono}, {"stereo", Setup::kStereo}, {"rgbd", Setup::kRgbd}},
                    "mono, stereo or rgbd [stereo]");
  simulation
      .add_option("--rig",
                  options->rig,
                  "Cameras that look in several directions, in place of --camera and --setup; see "
                  "--list")
      ->excludes("--camera")
      ->excludes("--setup");
  simulation.add_option("--motion", spec.motion, "How the camera moves; see --list")
      ->capture_default_str();
  simulation.add_option("--frames", spec.num_frames, "Number of frames")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  simulation.add_option("--rate", spec.rate_hz, "Frames per second")
      ->check(number_between(0.1, 1000.0))
      ->capture_default_str();
  simulation.add_option("--noise", spec.effects.noise_sigma, "Sigma of the grey values")
      ->check(number_between(0.0, 100.0))
      ->capture_default_str();
  simulation
      .add_option(
          "--exposure",
          options->exposure_ms,
          "Milliseconds that the shutter is open, of a world: what moves meanwhile blurs [0]")
      ->check(number_between(0.0, 1000.0));
  add_population_options(simulation, spec);
  simulation.add_option("--seed", spec.seed, "Of textures and noise")->capture_default_str();
  add_flaw_options(simulation, *options);
  add_imu_options(simulation, *options);
  simulation.add_flag("--list", options->is_list, "Print the worlds, motions and sequences");
  simulation.add_flag("--quiet", options->is_quiet, "Errors only");
  simulation.callback([options, &command] { command = [options] { return simulate(*options); }; });
}

}  // namespace waymark
