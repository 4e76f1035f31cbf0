// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_map.h"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/exchange/colmap_database.h"
#include "waymark/exchange/export_folder.h"
#include "waymark/exchange/export_split.h"
#include "waymark/exchange/exports.h"
#include "waymark/exchange/recorded_images.h"
#include "waymark/marker/known_markers.h"

namespace waymark {
namespace {

bool makes_folder(ExportFormat format) {
  return format == ExportFormat::kColmap || format == ExportFormat::kNerfstudio;
}

/// "points.ply", "points_1.ply" and so on.
std::filesystem::path numbered(std::filesystem::path path, std::size_t number) {
  if (number == 0) return path;
  return path.replace_filename(
      fmt::format("{}_{}{}", path.stem().string(), number, path.extension().string()));
}

void check_options(const MapExport& options) {
  const bool has_frames = options.frames.choice != FrameChoice::kKeyframes;
  if (options.is_undistorted && (options.split_views > 0 || !makes_folder(options.format))) {
    throw InputError("export",
                     "--undistort (undistort) is for colmap and nerfstudio, without split views");
  }
  if (!makes_folder(options.format)) {
    if (has_frames || !options.input.empty()) {
      throw InputError("export",
                       "--frames and --input (frames, input) are for models with images, expected "
                       "colmap or nerfstudio");
    }
    return;
  }
  if (has_frames && options.input.empty()) {
    throw InputError("export",
                     "--frames (frames) takes images that the map does not hold, expected "
                     "--input (input) with the recording that it was made of");
  }
  if (has_frames && options.trajectory.empty()) {
    throw InputError("export",
                     "--frames (frames) takes frames whose poses the map does not hold, expected "
                     "--trajectory (trajectory) with that of the run that made it");
  }
}

/// Whether any keyframe was seen by two cameras.
bool has_pairs(const Map& map) {
  bool has_pair = false;
  map.keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { has_pair |= keyframe.rig().cameras.size() > 1; });
  return has_pair;
}

/// Writes the models of a map's sub-maps, and their images, into a folder.
class ModelWriter {
 public:
  ModelWriter(const StoredMap& stored,
              const MapExport& options,
              const std::filesystem::path& folder)
      : stored_(stored), options_(options), folder_(folder) {
    if (options.format == ExportFormat::kColmap) database_.emplace(folder / "database.db");
    if (options.input.empty()) return;
    InputOptions reading = options.reading;
    if (!has_pairs(*stored.map)) reading.setup = Setup::kMono;
    recording_.emplace(options.input, std::move(reading));
    recording_->survey(*stored.map, !stored.images.empty());
  }

  void write(SubmapId submap) {
    const ExportScene scene = make_scene(submap);
    if (scene.views.empty()) return;  // The recording or the trajectory has none of it.
    SplitScene split;
    const CameraRegistry registry = CameraRegistry::with_builtin_models();
    if (options_.split_views > 0) {
      split = split_scene(scene, options_.split_views, registry);
    } else if (options_.is_undistorted) {
      split = undistort_scene(scene, registry);
    } else {
      split.parts.resize(scene.views.size());
      split.scene = scene;
    }
    if (database_) unlink_loose_views(split.scene);
    write_model(split.scene);
    counts_.num_views += split.scene.views.size();
    ++counts_.num_submaps;
    splits_.push_back(std::move(split));
  }

  MapExportCounts finish() {
    if (database_) database_->finish();
    if (recording_) {
      write_recorded_images();
    } else if (!stored_.images.empty()) {
      write_stored_images();
    }
    return counts_;
  }

 private:
  ExportScene make_scene(SubmapId submap) const {
    const Map& map = *stored_.map;
    if (!recording_) {
      // The map holds the images of camera 0 or none.
      const auto cameras = stored_.images.empty() ? ExportCameras::kAll : ExportCameras::kFirst;
      return make_export_scene(map, submap, stored_.images, cameras);
    }
    const bool has_images = !stored_.images.empty();
    const ExportScene scene =
        make_export_scene(map,
                          submap,
                          has_images ? stored_.images : recording_->keyframe_images(),
                          ExportCameras::kAll);
    std::vector<FramePlace> places =
        options_.frames.choice == FrameChoice::kKeyframes
            ? keyframe_places(map, submap)
            : place_frames(map, submap, options_.trajectory, options_.trajectory_name);
    recording_->find(places);
    std::vector<FramePlace> chosen;
    for (const std::size_t i : choose_frames(places, options_.frames, median_distance(scene))) {
      chosen.push_back(places[i]);
    }
    return with_frames(scene, map, chosen);
  }

  void write_model(const ExportScene& scene) {
    const std::size_t number = counts_.num_submaps;
    if (options_.format == ExportFormat::kNerfstudio) {
      NerfstudioPaths paths;
      paths.point_file = numbered(paths.point_file, number).string();
      const std::string json = format_nerfstudio(scene, paths, options_.is_undistorted);
      write_ply(folder_ / paths.point_file, scene);
      write_file_atomically(folder_ / numbered("transforms.json", number), json);
      return;
    }
    const auto form = options_.is_text ? ColmapFormat::kText : ColmapFormat::kBinary;
    const std::filesystem::path model = folder_ / "sparse" / fmt::to_string(number);
    write_colmap(model, scene, form, numbers_);
    database_->add(scene, numbers_);
    const std::string rig = format_colmap_rig(scene, numbers_);
    if (!rig.empty()) write_file_atomically(folder_ / numbered("rig.json", number), rig);
    numbers_.first_image += static_cast<std::uint32_t>(scene.views.size());
    numbers_.first_camera += static_cast<std::uint32_t>(scene.cameras.size());
  }

  void write_stored_images() {
    for (const SplitScene& split : splits_) {
      counts_.num_images +=
          write_split_images(folder_ / "images", folder_ / "masks", split, stored_.images);
    }
  }

  void write_recorded_images() {
    using SplitView = std::pair<const SplitScene*, std::size_t>;
    std::multimap<std::int64_t, SplitView> by_time;
    for (const SplitScene& split : splits_) {
      for (std::size_t v = 0; v < split.scene.views.size(); ++v) {
        by_time.emplace(split.scene.views[v].timestamp_ns, SplitView{&split, v});
      }
    }
    SplitImageWriter writer(folder_ / "images", folder_ / "masks");
    recording_->for_each([&](std::int64_t time_ns, const std::vector<std::string>& images) {
      const auto [begin, end] = by_time.equal_range(time_ns);
      for (auto found = begin; found != end; ++found) {
        const auto& [split, view] = found->second;
        const std::size_t camera = split->scene.views[view].rig_camera;
        if (camera >= images.size()) continue;
        writer.write(*split, view, images[camera]);
        ++counts_.num_images;
      }
    });
  }

  const StoredMap& stored_;
  const MapExport& options_;
  const std::filesystem::path folder_;
  std::optional<ColmapDatabase> database_;
  std::optional<RecordedImages> recording_;
  ColmapIds numbers_;
  std::vector<SplitScene> splits_;
  MapExportCounts counts_;
};

/// The markers of a sub-map as markers.yaml, as if they had been surveyed there.
void write_markers(const std::filesystem::path& path, const Map& map, SubmapId submap) {
  KnownMarkers markers;
  for (const MapMarker& marker : map.markers()) {
    if (map.submap_of(marker) != submap) continue;
    markers.by_id[marker.id] = {marker.side_m, map.world_from_marker(marker)};
  }
  write_file_atomically(path, format_known_markers(markers));
}

void write_file(const MapExport& options,
                const StoredMap& stored,
                SubmapId submap,
                std::size_t number) {
  const std::filesystem::path file = numbered(options.out, number);
  if (options.format == ExportFormat::kPly) {
    return write_ply(file, make_export_scene(*stored.map, submap, stored.images));
  }
  if (options.format == ExportFormat::kMarkers) return write_markers(file, *stored.map, submap);
  const auto format =
      options.format == ExportFormat::kTum ? TrajectoryFormat::kTum : TrajectoryFormat::kKitti;
  write_trajectory(file, keyframe_trajectory(*stored.map, submap), format);
}

}  // namespace

MapExportCounts export_map(const StoredMap& stored,
                           const std::string& name,
                           const MapExport& options) {
  check_options(options);
  const std::vector<SubmapId> submaps = submaps_by_size(*stored.map);
  if (options.format == ExportFormat::kMarkers && stored.map->markers().empty()) {
    throw InputError(name, "knows no markers, expected some (run --set markers.family=...)");
  }
  if (submaps.empty()) throw InputError(name, "has no keyframes, expected some to export");
  if (!makes_folder(options.format)) {
    for (std::size_t i = 0; i < submaps.size(); ++i) write_file(options, stored, submaps[i], i);
    return {submaps.size()};
  }
  ExportFolder folder(options.out);
  ModelWriter writer(stored, options, folder.unfinished());
  for (const SubmapId submap : submaps) writer.write(submap);
  MapExportCounts counts = writer.finish();
  counts.is_again = folder.is_again();
  if (counts.num_views == 0) {
    throw InputError(options.input.string(),
                     "has no frame of the map with a pose, expected the recording that it was made "
                     "of, and the trajectory of that run");
  }
  folder.finish();
  return counts;
}

}  // namespace waymark
