// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace waymark {

/// From now on the first Ctrl-C or SIGTERM is remembered, and the second one ends the program at
/// once with status 130.
void catch_interrupts();

/// Whether the user asked to end early.
bool is_interrupted();

}  // namespace waymark
