// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "waymark/exchange/export_frames.h"
#include "waymark/input/input.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// For whom a map is written.
enum class ExportFormat { kPly, kColmap, kNerfstudio, kTum, kKitti, kMarkers };

/// What to write of a map, and where.
struct MapExport {
  ExportFormat format = ExportFormat::kPly;
  std::filesystem::path out;    ///< A folder for kColmap and kNerfstudio, a file for the others.
  bool is_text = false;         ///< COLMAP's text form.
  int split_views = 0;          ///< See split_scene(); 0: as they are.
  bool is_undistorted = false;  ///< See undistort_scene().
  ExportedFrames frames;        ///< For kColmap and kNerfstudio. All but keyframes need the below.
  /// The recording that the map was made of: has the images of all frames and cameras; empty: those
  /// in the map alone.
  std::filesystem::path input;
  InputOptions reading;                 ///< Of the recording.
  std::vector<StampedPose> trajectory;  ///< Of camera 0 in the run that made the map, by time.
  std::string trajectory_name;          ///< For messages.
};

/// What was written.
struct MapExportCounts {
  std::size_t num_submaps = 0;  ///< Each in files of its own.
  std::size_t num_views = 0;    ///< Of models for COLMAP and nerfstudio.
  std::size_t num_images = 0;   ///< Image files, of which split views share none.
  bool is_again = false;        ///< An earlier export in the same folder was replaced.
};

/// Writes each sub-map that is a part of its own, the largest under the names that are asked for,
/// the others with _1 and so on. A folder is there as a whole or not at all (see ExportFolder).
/// `name` is what messages call the map. InputError for options that do not go together, a
/// trajectory or recording of something else, a map without keyframes, cameras that the format does
/// not know; OutputError.
MapExportCounts export_map(const StoredMap& stored,
                           const std::string& name,
                           const MapExport& options);

}  // namespace waymark
