// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "waymark/imu/inertial_report.h"
#include "waymark/mapfile/map_record.h"
#include "waymark/mapfile/map_record_writer.h"

namespace waymark {

// The record of the kind imu; see docs/map-format.md.

void write_imu(MapRecordWriter& writer, const InertialReport& imu);
/// InputError for what cannot be.
InertialReport read_imu(MapRecord& record);

}  // namespace waymark
