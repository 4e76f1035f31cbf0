// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "recorded_run.h"

#include <cstdlib>

#include "waymark/results/trajectory.h"
#include "waymark/session/session_options.h"

namespace waymark {

std::optional<std::filesystem::path> recorded_sequence(const std::string& name) {
  const char* data = std::getenv("WAYMARK_DATA");
  if (data == nullptr) return std::nullopt;
  const std::filesystem::path folder = std::filesystem::path(data) / name;
  if (!std::filesystem::exists(folder / "groundtruth.txt")) return std::nullopt;
  return folder;
}

RecordedResults map_recorded(const std::filesystem::path& folder,
                             Setup setup,
                             Timing timing,
                             std::optional<std::size_t> num_frames) {
  SessionOptions options;
  options.input = folder;
  options.timing = timing;
  options.reading.setup = setup;
  options.reading.frames = num_frames;
  // EuRoC and KITTI carry their calibration.
  if (!std::filesystem::exists(folder / "mav0") && !std::filesystem::exists(folder / "calib.txt")) {
    options.configs = {folder / "camchain.yaml"};
  }
  Session session = open_session(options);

  RecordedResults results;
  results.session = run_session(*session.input, *session.system);
  EvaluationOptions evaluation;
  evaluation.alignment =
      setup == Setup::kMono ? TrajectoryAlignment::kSim3 : TrajectoryAlignment::kSe3;
  if (!results.session.trajectories.empty()) {
    results.evaluation = evaluate(results.session.trajectories.front(),
                                  read_trajectory(folder / "groundtruth.txt"),
                                  evaluation);
  }
  return results;
}

}  // namespace waymark
