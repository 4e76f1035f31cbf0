// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/place_islands.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

constexpr std::uint32_t kLength = 100;

/// Two ways of a metre per step side by side, of which the second is somewhere else in the graph.
class PlaceIslandsTest : public ::testing::Test {
 protected:
  PlaceIslandsTest() {
    Vector7d wrong;
    wrong << 30.0, -20.0, 5.0, 0.2, 1.0, -0.3, 0.0;
    for (std::uint32_t node = 0; node < 2 * kLength; ++node) {
      const Sim3 moved = node < kLength ? Sim3() : Sim3::exp(wrong);
      graph_.node_from_world.push_back(truth(node) * moved);
    }
    graph_.is_fixed.assign(2 * kLength, 0);
    graph_.is_fixed[3] = 1;
    graph_.is_scale_free = false;
    for (std::uint32_t node = 1; node < 2 * kLength; ++node) {
      if (node != kLength) add(node - 1, node, motion(node - 1, node), 0.02);
    }
    first_tie_ = graph_.edges.size();
  }

  static Sim3 truth(std::uint32_t node) {
    const double side = node < kLength ? 0.0 : 3.0;
    return Sim3(Rigid3({1.0, 0.0, 0.0, 0.0}, {-1.0 * (node % kLength), side, 0.0}));
  }
  static Sim3 motion(std::uint32_t from, std::uint32_t to) {
    return truth(to) * truth(from).inverse();
  }

  void add(std::uint32_t from, std::uint32_t to, const Sim3& to_from_from, double sigma) {
    PoseGraphEdge edge;
    edge.from = from;
    edge.to = to;
    edge.to_from_from = to_from_from;
    edge.sigma_translation = sigma;
    edge.sigma_rotation_rad = 0.05 * sigma;
    graph_.edges.push_back(edge);
  }
  void add_true(std::uint32_t a, std::uint32_t b) { add(a, b, motion(a, b), 0.1); }
  /// As if the one were where another is.
  void add_false(std::uint32_t a, std::uint32_t b) { add(a, b, Sim3(), 0.1); }

  std::vector<std::size_t> place(std::vector<std::size_t> believed) {
    for (std::size_t& tie : believed) tie += first_tie_;
    const IslandTies ties =
        place_islands(graph_, first_tie_, {.same_place = 100.0, .believed = std::move(believed)});
    num_contradicting_ = ties.contradicting.size();
    std::vector<std::size_t> now = ties.believed;
    for (std::size_t& tie : now) tie -= first_tie_;
    return now;
  }

  /// Of where the second way is, in metres.
  double error() const {
    double worst = 0.0;
    for (std::uint32_t node = 0; node < 2 * kLength; ++node) {
      const Sim3 off = graph_.node_from_world[node] * truth(node).inverse();
      worst = std::max(worst, off.translation.norm());
    }
    return worst;
  }

  PoseGraph graph_;
  std::size_t first_tie_ = 0;
  std::size_t num_contradicting_ = 0;
};

TEST_F(PlaceIslandsTest, TakesWhatMostPlacesAgreeOn) {
  add_false(10, kLength + 70);
  add_true(20, kLength + 22);
  add_true(kLength + 58, 60);  // Either way round.
  EXPECT_EQ(place({0}), (std::vector<std::size_t>{1}));
  EXPECT_LT(error(), 1e-9);
}

TEST_F(PlaceIslandsTest, BelievesOnEqualTermsWhatItDidBefore) {
  add_true(20, kLength + 22);
  add_false(10, kLength + 70);
  EXPECT_EQ(place({1}), (std::vector<std::size_t>{1}));
  EXPECT_GT(error(), 10.0);
  EXPECT_EQ(place({0}), (std::vector<std::size_t>{0}));
  EXPECT_LT(error(), 1e-9);
}

TEST_F(PlaceIslandsTest, CountsWhatIsOfOnePlaceOnce) {
  add_true(20, kLength + 22);
  for (const std::uint32_t node : {10, 12, 14, 16}) add_false(node, kLength + 60 + node);
  EXPECT_EQ(place({0}), (std::vector<std::size_t>{0}));
  EXPECT_LT(error(), 1e-9);
}

TEST_F(PlaceIslandsTest, KeepsAllThatAgreeOfThoseBelieved) {
  add_true(20, kLength + 22);
  add_true(50, kLength + 52);
  add_false(10, kLength + 70);
  add_true(90, kLength + 95);
  EXPECT_EQ(place({0, 2, 3}), (std::vector<std::size_t>{0, 3}));
  EXPECT_EQ(num_contradicting_, 1u);
}

TEST_F(PlaceIslandsTest, LeavesOneIslandAsItIs) {
  add(kLength - 1, kLength, motion(kLength - 1, kLength), 0.02);
  first_tie_ = graph_.edges.size();
  add_false(10, kLength + 70);
  add_true(20, kLength + 22);
  add_true(60, kLength + 58);
  const double before = error();
  EXPECT_EQ(place({0}), (std::vector<std::size_t>{0}));
  EXPECT_EQ(error(), before);
  EXPECT_EQ(num_contradicting_, 0u);
}

}  // namespace
}  // namespace waymark
