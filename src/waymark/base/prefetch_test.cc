// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/prefetch.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

TEST(Prefetch, GivesResultsInOrderForAnyNumberOfThreads) {
  for (const unsigned num_threads : {1u, 2u, 5u}) {
    Prefetch<int> prefetch(num_threads, 7);
    int next = 0, expected = 0;
    while (expected < 500) {
      while (next < 500 && prefetch.size() < 7) {
        prefetch.give([i = next++, num_threads](unsigned thread) {
          EXPECT_LT(thread, num_threads);
          return i * i;
        });
      }
      EXPECT_EQ(prefetch.take(), expected * expected);
      ++expected;
    }
    EXPECT_EQ(prefetch.size(), 0u);
  }
}

TEST(Prefetch, HandsOnWhatAPieceThrows) {
  Prefetch<int> prefetch(2, 3);
  prefetch.give([](unsigned) -> int { throw std::runtime_error("piece 0"); });
  prefetch.give([](unsigned) { return 1; });
  EXPECT_THROW(prefetch.take(), std::runtime_error);
  EXPECT_EQ(prefetch.take(), 1);
}

TEST(Prefetch, NeitherBeginsWhatIsDroppedNorWhatNobodyWillTake) {
  Mailbox<bool> gate(1), has_begun(1);
  std::vector<int> done;
  const auto held = std::make_shared<int>(0);
  {
    Prefetch<int> prefetch(1, 4);
    prefetch.give([&](unsigned) {
      has_begun.push(true);
      return gate.pop().has_value();
    });
    for (int i = 1; i < 4; ++i) {
      prefetch.give([&done, held, i](unsigned) {
        done.push_back(i);
        return i;
      });
    }
    has_begun.pop();
    prefetch.drop();
    prefetch.drop();
    gate.push(true);
    EXPECT_EQ(prefetch.take(), 2);
    EXPECT_EQ(prefetch.take(), 3);
    prefetch.give([&](unsigned) {
      has_begun.push(true);
      return gate.pop().has_value();
    });
    has_begun.pop();
    prefetch.give([held](unsigned) { return 5; });
    EXPECT_EQ(held.use_count(), 2);
    gate.close();
  }
  EXPECT_THAT(done, ::testing::ElementsAre(2, 3));
  EXPECT_EQ(held.use_count(), 1);
}

/// Cores on which work takes simulated time: a piece ends when it is its turn by their own clock.
class SimulatedCores {
 public:
  explicit SimulatedCores(std::size_t num_pieces) : begun_(num_pieces) {
    for (std::size_t i = 0; i < num_pieces; ++i) {
      ends_.push_back(std::make_unique<Mailbox<bool>>(1));
    }
  }

  /// A piece that takes so long; for the thread that does it.
  std::size_t run(std::size_t piece, double duration) {
    begun_.push({piece, duration});
    ends_[piece]->pop();
    return piece;
  }

  /// Waits until so many are at work, then goes on to when the first of them ends.
  void end_next(std::size_t num_busy) {
    while (running_.size() < num_busy) {
      const Begun begun = *begun_.pop();
      running_.insert({now_ + begun.duration, begun.piece});
    }
    const auto [end, piece] = *running_.begin();
    busy_time_ += static_cast<double>(running_.size()) * (end - now_);
    now_ = end;
    running_.erase(running_.begin());
    ended_.insert(piece);
    ends_[piece]->push(true);
  }

  bool has_ended(std::size_t piece) const { return ended_.contains(piece); }
  std::size_t num_ended() const { return ended_.size(); }
  double mean_busy() const { return busy_time_ / now_; }

 private:
  struct Begun {
    std::size_t piece;
    double duration;
  };

  Mailbox<Begun> begun_;
  std::vector<std::unique_ptr<Mailbox<bool>>> ends_;
  std::set<std::pair<double, std::size_t>> running_;
  std::set<std::size_t> ended_;
  double now_ = 0.0;
  double busy_time_ = 0.0;
};

// Times scatter as those of features do, and one piece in fifty takes three times as long. Were
// there a core without work where there is some, the test would wait for ever.
TEST(Prefetch, KeepsSixteenCoresBusy) {
  constexpr unsigned kNumCores = 16;
  constexpr std::size_t kNumPieces = 2000, kCapacity = 2 * kNumCores;
  SimulatedCores cores(kNumPieces);
  Prefetch<std::size_t> prefetch(kNumCores, kCapacity);
  Rng rng(1, 0);
  std::size_t num_given = 0;
  const auto give = [&] {
    const double usual = rng.uniform(0.7, 1.3);
    const double duration = num_given % 50 == 49 ? 3.0 * usual : usual;
    prefetch.give(
        [&cores, piece = num_given, duration](unsigned) { return cores.run(piece, duration); });
    ++num_given;
  };
  for (std::size_t num_taken = 0; num_taken < kNumPieces; ++num_taken) {
    while (num_given < kNumPieces && prefetch.size() < kCapacity) give();
    while (!cores.has_ended(num_taken)) {
      cores.end_next(std::min<std::size_t>(kNumCores, num_given - cores.num_ended()));
    }
    ASSERT_EQ(prefetch.take(), num_taken);
  }
  EXPECT_GE(cores.mean_busy(), 10.0);
}

}  // namespace
}  // namespace waymark
