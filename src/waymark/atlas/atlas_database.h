// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "waymark/atlas/atlas.h"

struct sqlite3;

namespace waymark {

/// The data base of an atlas, an SQLite file. As one of somebody else's: nothing that it defines is
/// run, and every value is judged before it counts.
class AtlasDatabase {
 public:
  /// Makes an empty one; what is there is replaced.
  static void create(const std::filesystem::path& path);

  /// InputError for what is none.
  AtlasDatabase(const std::filesystem::path& path, bool is_writable);
  ~AtlasDatabase();

  /// How often it was written.
  std::int64_t generation() const;
  AtlasContents read() const;
  SharedLandmarks read_shared(const std::string& origin_a, const std::string& origin_b) const;

  /// In one transaction. Gives the new generation; OutputError where the one there is another.
  std::int64_t write(const AtlasContents& contents,
                     const std::vector<NewShared>& shared,
                     std::int64_t generation);

 private:
  struct Close {
    void operator()(sqlite3* base) const;
  };

  void read_tiles(AtlasContents& contents) const;
  void read_links(AtlasContents& contents) const;

  std::filesystem::path path_;
  std::unique_ptr<sqlite3, Close> base_;
};

}  // namespace waymark
