// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "waymark/atlas/atlas.h"
#include "waymark/bag/sqlite_file.h"

namespace waymark {

/// The data base of an atlas, an SQLite file. As one of somebody else's: nothing that it defines is
/// run, and every value is judged before it counts. An object is one transaction: what it reads is
/// of one moment, and one that writes keeps others from it, and waits for them.
class AtlasDatabase {
 public:
  /// Makes an empty one where there is none, or none that is complete; what is there stays.
  static void create(const std::filesystem::path& path);

  /// InputError for what is none.
  AtlasDatabase(const std::filesystem::path& path, bool is_writable);
  /// Takes back what was written since finish().
  ~AtlasDatabase();

  /// How often it was written.
  std::int64_t generation() const;
  AtlasContents read() const;
  SharedLandmarks read_shared(const std::string& origin_a, const std::string& origin_b) const;

  /// Replaces all that it says; the generation becomes the next one.
  void write(const AtlasContents& contents, const std::vector<NewShared>& shared);
  /// What was written counts from here on.
  void finish();

 private:
  void read_tiles(AtlasContents& contents) const;
  void read_links(AtlasContents& contents) const;

  std::filesystem::path path_;
  SqliteDatabase base_;
};

}  // namespace waymark
