// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/failure.h"

#include <filesystem>
#include <new>
#include <system_error>

#include "waymark/base/check.h"

namespace waymark {

std::string describe_failure(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const InputError& error) {
    return error.what();
  } catch (const OutputError& error) {
    return error.what();
  } catch (const std::bad_alloc&) {
    return "waymark: out of memory";
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string path = error.path1().empty() ? "waymark" : error.path1().string();
    return path + ": " + error.code().message() + ", expected a path that can be used";
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) {
      return "waymark: cannot start another thread: " + error.code().message() +
             ", expected higher limits of threads and memory (ulimit -u, -v)";
    }
    return std::string("waymark: ") + error.what();
  } catch (const std::exception& error) {
    return std::string("waymark: internal failure: ") + error.what();
  }
}

}  // namespace waymark
