// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/failure.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <new>
#include <system_error>

#include "waymark/base/check.h"

namespace waymark {
namespace {

template <class Exception>
std::string description_of(const Exception& exception) {
  return describe_failure(std::make_exception_ptr(exception));
}

TEST(DescribeFailure, IsOneLineThatSaysWhereAndWhat) {
  EXPECT_EQ(description_of(InputError("cam.yaml:3", "no")), "cam.yaml:3: no");
  EXPECT_EQ(description_of(OutputError("out", "is full")), "out: is full");
  EXPECT_EQ(description_of(std::bad_alloc()), "waymark: out of memory");
  EXPECT_EQ(description_of(CheckError("a.cc:3: check failed: x")),
            "waymark: internal failure: a.cc:3: check failed: x");
}

TEST(DescribeFailure, NamesWhatTheSystemDenies) {
  const auto denied = std::make_error_code(std::errc::permission_denied);
  EXPECT_EQ(description_of(std::filesystem::filesystem_error("status", "a.png", denied)),
            "a.png: Permission denied, expected a path that can be used");
  const auto no_thread = std::make_error_code(std::errc::resource_unavailable_try_again);
  EXPECT_EQ(description_of(std::system_error(no_thread)),
            "waymark: cannot start another thread: Resource temporarily unavailable, expected "
            "higher limits of threads and memory (ulimit -u, -v)");
}

}  // namespace
}  // namespace waymark
