// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace waymark::testing {

/// How often this test program has allocated memory.
long num_allocations();

}  // namespace waymark::testing
