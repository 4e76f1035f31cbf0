// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "waymark/map/map.h"
#include "waymark/mapfile/map_record.h"
#include "waymark/mapfile/map_record_writer.h"

namespace waymark {

// The records of the kind odometry; see docs/map-format.md.

void write_odometry(MapRecordWriter& writer, const Map& map);
/// That of some keyframes; ids ascend.
void write_odometry(MapRecordWriter& writer, const Map& map, const std::vector<KeyframeId>& ids);

/// What a record holds, ascending, of keyframes below `end` and above `last`, the last one of the
/// records before, which it moves on. InputError for what cannot be.
std::vector<MapParts::StoredOdometry> read_odometry(MapRecord& record,
                                                    KeyframeId end,
                                                    KeyframeId& last);

}  // namespace waymark
