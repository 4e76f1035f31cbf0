// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A map of any size, in tiles that are opened one by one.
//
//   const Atlas atlas = Atlas::open("building.atlas");
//   for (const AtlasTile& tile : atlas.contents().tiles) {
//     const StoredMap stored = atlas.load_tile(tile);
//     stored.map->landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
//       std::cout << (tile.atlas_from_tile * landmark.position_in_world).transpose() << "\n";
//     });
//   }

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/base/scratch_folder.h"
#include "waymark/geometry/sim3.h"
#include "waymark/mapfile/map_file.h"

namespace waymark {

/// Landmarks of two tiles that are one and the same point, ascending: (of a, of b).
using SharedLandmarks = std::vector<std::pair<LandmarkId, LandmarkId>>;

/// A recording whose map is part of an atlas.
struct AtlasRecording {
  std::string checksum;     ///< SHA-256 of the map file that was cut.
  std::string name;         ///< For people.
  std::uint32_t since = 0;  ///< Counts how often recordings were added before.
};

/// A tile: a map file of a bounded number of keyframes that never changes, and what of it is known
/// without opening it.
struct AtlasTile {
  std::string origin;               ///< SHA-256 of its file as it was cut: who it is.
  std::string checksum;             ///< SHA-256 of its file: which state of it counts.
  std::string places;               ///< SHA-256 of the file with its part of the place index.
  std::uint32_t recording = 0;      ///< Index in AtlasContents::recordings.
  std::uint32_t submap = 0;         ///< Which of the recording's sub-maps it was cut from.
  std::uint32_t num_keyframes = 0;  ///< That it has.
  std::uint32_t num_landmarks = 0;  ///< That it has.
  bool is_metric = false;           ///< Whether its lengths are metres; else the scale is free.
  double pixel_angle_rad =
      0.0;  ///< What a pixel in the middle of its images covers, in the median.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< Mean position of its rigs, in its frame.
  double radius = 0.0;  ///< Root mean square distance of its rigs from there.
  /// Its anchor: where it lies in the frame of its part of the atlas.
  Sim3 atlas_from_tile;
  std::uint32_t frame = 0;  ///< Which part; tiles of different parts are not connected.
};

/// What two tiles are known to show both.
struct AtlasLink {
  std::uint32_t a = 0;           ///< Index of a tile.
  std::uint32_t b = 0;           ///< Index of a later one.
  bool is_border = false;        ///< They were cut from one map; else the place was recognised.
  Sim3 b_from_a;                 ///< By the shared landmarks; of the frames of the tiles.
  std::uint32_t num_shared = 0;  ///< Landmarks; see Atlas::read_shared().
};

/// Everything of an atlas but its tiles.
struct AtlasContents {
  std::vector<AtlasRecording> recordings;  ///< Ascending by checksum.
  std::vector<AtlasTile> tiles;            ///< Ascending by origin.
  std::vector<AtlasLink> links;            ///< Ascending by a, then by b.
};

/// Shared landmarks of a link that is new, by the origins of its tiles, a before b.
struct NewShared {
  std::string origin_a;       ///< Of the tile that comes first.
  std::string origin_b;       ///< Of the other one.
  SharedLandmarks landmarks;  ///< That both show.
};

/// What is to become the state of an atlas.
struct AtlasChange {
  AtlasContents contents;         ///< All of it, sorted.
  std::vector<NewShared> shared;  ///< Of the links that are new.
};

/// A folder with a map of any size in tiles; docs/atlas-format.md describes its files. Tiles are
/// written once and never changed; what counts is said by one data base, which changes in
/// transactions: at any moment there is the old state or the new one. Any number of programs may
/// read and write it at a time: a new state replaces the one that it was made from, or nothing.
///
/// Every reading function throws InputError for what is damaged or made to do harm, every writing
/// one OutputError.
class Atlas {
 public:
  /// Opens one that is there.
  static Atlas open(const std::filesystem::path& folder);
  /// The same, or makes an empty one where there is nothing. InputError where something else is.
  static Atlas open_or_create(const std::filesystem::path& folder);

  /// A folder for tiles alone, without a state: for those who make them and publish them elsewhere.
  static Atlas of_tiles(const std::filesystem::path& folder);

  /// Where it is.
  const std::filesystem::path& folder() const { return folder_; }
  /// As of when it was opened, last written or last read.
  const AtlasContents& contents() const { return contents_; }

  /// Where the file of a tile in this state is.
  std::filesystem::path tile_path(const std::string& checksum) const;
  /// Where the file of its places is.
  std::filesystem::path places_path(const std::string& checksum) const;
  /// Whether both files of a tile are there as their names say.
  bool is_whole(const AtlasTile& tile) const;

  /// The map of a tile. Its size is what the data base says.
  StoredMap load_tile(const AtlasTile& tile) const;
  /// What the tiles of a link both show.
  SharedLandmarks read_shared(const AtlasLink& link) const;

  /// Keeps a map for a state that refers to it, as one of its tiles; gives its checksum. Nobody
  /// else sees or removes the file before there is such a state.
  std::string store_tile(const StoredMap& tile);
  /// The same with its places.
  std::string store_places(const Map& tile);
  /// The same with the file of a tile, or of places, of another folder. InputError where it is
  /// not what its name says.
  void store_file(const std::filesystem::path& path);

  /// Makes this the state of the atlas, and removes files that no tile refers to any more. False,
  /// and nothing is written, where another program has changed the atlas since contents() was
  /// read, which is then read anew.
  [[nodiscard]] bool commit(const AtlasChange& change);
  /// Makes the state what a plan makes of contents(), planning again as often as another program
  /// changes the atlas meanwhile. The plan gives nothing where there is nothing to change.
  void change(const std::function<std::optional<AtlasChange>()>& plan);
  /// Reads the state that is there now; whether it is another one.
  bool reload();

 private:
  explicit Atlas(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path path_of(const std::string& name) const;
  std::string keep(const std::filesystem::path& file, const char* ending) const;
  const std::filesystem::path& new_files();
  void publish_files(const AtlasContents& contents) const;
  void remove_unused() const;

  std::filesystem::path folder_;
  AtlasContents contents_;
  std::int64_t generation_ = -1;
  bool has_state_ = true;
  std::shared_ptr<const ScratchFolder> new_files_;  ///< Null until there is one.
};

/// Everything that is wrong with an atlas, its tiles and its data base, a line each, up to 1000.
std::vector<std::string> find_atlas_faults(const std::filesystem::path& folder);

/// Whether a path is the folder of an atlas.
bool is_atlas(const std::filesystem::path& path);

/// Brings recordings, tiles and links into order; what refers to them by index follows.
void sort_contents(AtlasContents& contents);

}  // namespace waymark
