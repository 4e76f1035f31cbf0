// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "waymark/bag/bag.h"
#include "waymark/input/imu_stream.h"

namespace waymark {

/// The inertial data of a bag: of the topics of sensor_msgs/Imu the one with the most messages that
/// have turns and accelerations, else one of turns with one of accelerations, as RealSense's driver
/// has them. Nothing where there is none. time_of: of a message. Throws InputError.
std::optional<ImuStream> imu_of_bag(const Bag& bag,
                                    const std::function<std::int64_t(const BagMessage&)>& time_of);

}  // namespace waymark
