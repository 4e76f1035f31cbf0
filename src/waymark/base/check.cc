// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/check.h"

namespace waymark {

void fail_check(const char* condition, const char* file, int line) {
  throw CheckError(std::string(file) + ":" + std::to_string(line) + ": check failed: " + condition);
}

}  // namespace waymark
