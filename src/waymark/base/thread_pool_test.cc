// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/thread_pool.h"

#include <gmock/gmock.h>

#include <numeric>
#include <stdexcept>
#include <string>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"

namespace waymark {
namespace {

TEST(ThreadPool, VisitsEveryElementOnce) {
  for (const unsigned num_threads : {0u, 1u, 2u, 5u}) {
    ThreadPool pool(num_threads);
    EXPECT_EQ(pool.num_threads(), std::max(num_threads, 1u));
    for (const std::size_t count : {0u, 1u, 7u, 8u, 9u, 1000u}) {
      std::vector<int> visits(count, 0);
      pool.for_chunks(count, 8, [&](std::size_t begin, std::size_t end) {
        EXPECT_LE(end - begin, 8u);
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
      });
      EXPECT_THAT(visits, ::testing::Each(1)) << count;
    }
  }
}

TEST(ThreadPool, SumsHaveTheSameBitsOnAnyNumberOfThreads) {
  Rng rng(1, 0);
  std::vector<double> terms(20000);
  for (double& term : terms) term = rng.normal() * 1e6;
  const auto sum_with = [&](unsigned num_threads) {
    ThreadPool pool(num_threads);
    std::vector<double> sums(terms.size() / 128 + 1);
    pool.for_chunks(terms.size(), 128, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) sums[begin / 128] += terms[i];
    });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
  };
  const double expected = sum_with(1);
  EXPECT_NE(expected, 0.0);
  for (const unsigned num_threads : {2u, 3u, 8u}) EXPECT_EQ(sum_with(num_threads), expected);
}

TEST(ThreadPool, ManyShortLoopsInARow) {
  ThreadPool pool(4);
  std::vector<std::size_t> values(64, 0);
  for (std::size_t round = 0; round < 3000; ++round) {
    pool.for_chunks(values.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) values[i] += i;
    });
  }
  for (std::size_t i = 0; i < values.size(); ++i) ASSERT_EQ(values[i], 3000 * i);
}

TEST(ThreadPool, TheFirstFailureComesOutAndThePoolGoesOn) {
  ThreadPool pool(3);
  for (int round = 0; round < 50; ++round) {
    std::vector<int> visits(100, 0);
    try {
      pool.for_chunks(100, 1, [&](std::size_t begin, std::size_t) {
        ++visits[begin];
        if (begin % 10 == 7) throw std::runtime_error(std::to_string(begin));
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "7");
    }
    EXPECT_THAT(visits, ::testing::Each(1));
  }
}

TEST(ThreadPool, NestedLoopsAreRefused) {
  ThreadPool pool(2);
  const auto nothing = [](std::size_t, std::size_t) {};
  EXPECT_THROW(
      pool.for_chunks(4, 1, [&](std::size_t, std::size_t) { pool.for_chunks(1, 1, nothing); }),
      CheckError);
  pool.for_chunks(4, 1, nothing);
}

}  // namespace
}  // namespace waymark
