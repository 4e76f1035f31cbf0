// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "waymark/exchange/exports.h"

struct sqlite3;

namespace waymark {

/// COLMAP takes two views for connected that share so many points (its min_num_matches), and falls
/// over features of views that are connected to none.
inline constexpr std::size_t kMinColmapMatches = 15;

/// Takes the features from the views that COLMAP would find connected to no other, and the points
/// that they saw from views that then see them alone. The views and the points stay.
void unlink_loose_views(ExportScene& scene);

/// A database of COLMAP ("Database Format" of its documentation): cameras, images, the features of
/// the views, and between every two views the features that show the same points. Its
/// point_triangulator wants one whose images and features are those of the model. Descriptors are
/// none: COLMAP knows others.
class ColmapDatabase {
 public:
  /// Makes the file; what was there is gone. Throws OutputError, as do the others.
  explicit ColmapDatabase(const std::filesystem::path& path);
  ~ColmapDatabase();
  ColmapDatabase(const ColmapDatabase&) = delete;
  ColmapDatabase& operator=(const ColmapDatabase&) = delete;

  /// Adds a model that is written with the same numbers.
  void add(const ExportScene& scene, ColmapIds numbers);
  /// Once, at the end; without it there is nothing in the file.
  void finish();

 private:
  const std::filesystem::path path_;
  struct Close {
    void operator()(sqlite3* base) const;
  };
  std::unique_ptr<sqlite3, Close> base_;
};

}  // namespace waymark
