// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "waymark/imu/inertial_report.h"
#include "waymark/mapfile/map_record.h"
#include "waymark/mapfile/map_record_writer.h"

namespace waymark {

// The record of the kind imu; see docs/map-format.md.

/// Nothing of an IMU that is not used.
void write_imu(MapRecordWriter& writer, const std::optional<InertialReport>& report);
/// InputError for what cannot be.
InertialReport read_imu(MapRecord& record);

}  // namespace waymark
