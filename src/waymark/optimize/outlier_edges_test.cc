// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/outlier_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/base/rng.h"
#include "waymark/geometry/alignment.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

constexpr double kSigmaStepM = 0.02;
constexpr double kSigmaStepRad = 0.001;
constexpr double kSigmaStepLogScale = 0.004;
/// What loops are said to be known to; the true ones are twice as good.
constexpr double kSigmaLoopM = 0.1;
constexpr double kSigmaLoopRad = 0.005;
constexpr double kSigmaLoopLogScale = 0.01;

Sim3 noise(Rng& rng, double sigma_m, double sigma_rad, double sigma_log_scale) {
  Vector7d tangent;
  for (int i = 0; i < 7; ++i) {
    tangent[i] = (i < 3 ? sigma_m : i < 6 ? sigma_rad : sigma_log_scale) * rng.normal();
  }
  return Sim3::exp(tangent);
}

/// A way through the streets of a town, two metres a step, by odometry, and loops between places of
/// it.
class TownGraph {
 public:
  TownGraph(std::uint64_t seed, bool is_metric, std::uint32_t num_nodes)
      : rng_(seed, 0), is_metric_(is_metric) {
    graph.is_scale_free = !is_metric;
    walk(num_nodes);
    for (std::uint32_t i = 0; i < num_nodes; ++i) {
      if (i > 0 && !is_metric) log_units_ += kSigmaStepLogScale * rng_.normal();
      const Sim3 units({1.0, 0.0, 0.0, 0.0}, Eigen::Vector3d::Zero(), std::exp(log_units_));
      in_units_.push_back(units * Sim3(world_from_node[i].inverse()));
      if (i == 0) {
        graph.node_from_world.push_back(in_units_[0]);
      } else {
        add_step(i);
      }
    }
    graph.is_fixed.assign(num_nodes, 0);
    graph.is_fixed[0] = 1;
  }

  void add_true_loops(std::size_t count) {
    for (std::size_t i = 0; i < count;) {
      const auto [from, to] = some_pair();
      const Rigid3 apart = world_from_node[to].inverse() * world_from_node[from];
      if (apart.translation.norm() > 3.0 || so3_log(apart.rotation).norm() > 0.5) continue;
      add_loop(from, to, true_motion(from, to), true);
      ++i;
    }
  }

  /// Places that merely look alike, seen from about the same pose, `num_in_row` times as if the
  /// camera went by there: these agree with each other.
  void add_false_loops(std::size_t count, std::uint32_t num_in_row) {
    for (std::size_t i = 0; i < count;) {
      const auto [from, to] = some_pair();
      const std::uint32_t length = kStride * num_in_row;
      const Eigen::Vector3d apart =
          world_from_node[to].translation - world_from_node[from].translation;
      if (apart.norm() < 10.0 || to + length > world_from_node.size()) continue;
      const Sim3 error = noise(rng_, 1.0, 0.1, is_metric_ ? 0.0 : 0.05);
      for (std::uint32_t k = 0; k < length && i < count; k += kStride, ++i) {
        add_loop(
            from + k, to + k, true_motion(to, to + k) * error * true_motion(from + k, from), false);
      }
    }
  }

  std::size_t count(std::span<const std::uint8_t> is_on, bool is_true) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < is_on.size(); ++i) {
      count += graph.edges[i].is_robust && is_true_[i] == is_true && is_on[i];
    }
    return count;
  }

  /// Root mean square distance from the truth of the optimum by some of the edges.
  double error_with(std::span<const std::uint8_t> is_on) const {
    PoseGraph chosen = graph;
    chosen.edges.clear();
    for (std::size_t i = 0; i < is_on.size(); ++i) {
      if (!is_on[i]) continue;
      chosen.edges.push_back(graph.edges[i]);
      chosen.edges.back().is_robust = false;
    }
    optimize_pose_graph(chosen, {.max_iterations = 30});
    std::vector<Eigen::Vector3d> mapped, truth;
    for (std::size_t i = 0; i < world_from_node.size(); ++i) {
      mapped.push_back(chosen.node_from_world[i].inverse().translation);
      truth.push_back(world_from_node[i].translation);
    }
    const Sim3 truth_from_mapped = is_metric_ ? Sim3(align_rigid(mapped, truth).value())
                                              : align_similarity(mapped, truth).value();
    double sum = 0.0;
    for (std::size_t i = 0; i < mapped.size(); ++i) {
      sum += (truth_from_mapped * mapped[i] - truth[i]).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(mapped.size()));
  }

  const std::vector<std::uint8_t>& is_true() const { return is_true_; }

  PoseGraph graph;
  std::vector<Rigid3> world_from_node;

 private:
  static constexpr std::uint32_t kStride = 4;
  static constexpr int kStepsPerStreet = 20;
  static constexpr double kStepM = 2.0;

  /// Each street is passed some three times.
  void walk(std::uint32_t num_nodes) {
    const int side = 2 + static_cast<int>(std::sqrt(num_nodes / (6.0 * kStepsPerStreet)));
    Eigen::Vector2i crossing(side / 2, side / 2);
    int direction = 0;
    while (true) {
      const auto ahead = [&](int turn) {
        const int turned = (direction + turn) % 4;
        return Eigen::Vector2i((turned == 0) - (turned == 2), (turned == 1) - (turned == 3));
      };
      int turn = 0;
      do {
        turn = 3 + static_cast<int>(rng_.below(3));
      } while ((crossing + ahead(turn)).minCoeff() < 0 ||
               (crossing + ahead(turn)).maxCoeff() >= side);
      const Eigen::Vector2i step = ahead(turn);
      direction = (direction + turn) % 4;
      for (int k = 0; k < kStepsPerStreet; ++k) {
        const Eigen::Vector2d at = kStepM * (kStepsPerStreet * crossing + k * step).cast<double>() +
                                   0.3 * Eigen::Vector2d(rng_.normal(), rng_.normal());
        const double yaw = 0.5 * M_PI * (1.0 - direction) + 0.05 * rng_.normal();
        world_from_node.emplace_back(so3_exp({0.0, yaw, 0.0}),
                                     Eigen::Vector3d(at.x(), 0.0, at.y()));
        if (world_from_node.size() == num_nodes) return;
      }
      crossing += step;
    }
  }

  void add_step(std::uint32_t to) {
    Sim3 step = true_motion(to - 1, to);
    step.scale = 1.0;  // Odometry does not see its scale drift.
    PoseGraphEdge edge;
    edge.from = to - 1;
    edge.to = to;
    edge.to_from_from = noise(rng_, kSigmaStepM, kSigmaStepRad, 0.0) * step;
    edge.sigma_translation = kSigmaStepM;
    edge.sigma_rotation_rad = kSigmaStepRad;
    edge.sigma_log_scale = kSigmaStepLogScale;
    graph.edges.push_back(edge);
    is_true_.push_back(1);
    graph.node_from_world.push_back(edge.to_from_from * graph.node_from_world.back());
  }

  std::pair<std::uint32_t, std::uint32_t> some_pair() {
    const auto end = static_cast<std::uint32_t>(world_from_node.size());
    while (true) {
      const std::uint32_t from = rng_.below(end);
      const std::uint32_t to = rng_.below(end);
      if (from + 50 < to) return {from, to};
    }
  }

  Sim3 true_motion(std::uint32_t from, std::uint32_t to) const {
    return in_units_[to] * in_units_[from].inverse();
  }

  void add_loop(std::uint32_t from, std::uint32_t to, const Sim3& to_from_from, bool is_true) {
    PoseGraphEdge edge;
    edge.from = from;
    edge.to = to;
    edge.sigma_translation = kSigmaLoopM;
    edge.sigma_rotation_rad = kSigmaLoopRad;
    edge.sigma_log_scale = kSigmaLoopLogScale;
    edge.to_from_from = noise(rng_,
                              0.5 * kSigmaLoopM,
                              0.5 * kSigmaLoopRad,
                              is_metric_ ? 0.0 : 0.5 * kSigmaLoopLogScale) *
                        to_from_from;
    edge.is_robust = true;
    graph.edges.push_back(edge);
    is_true_.push_back(is_true);
  }

  Rng rng_;
  bool is_metric_;
  double log_units_ = 0.0;             // Of the map by the world.
  std::vector<Sim3> in_units_;         // The truth in the units of each node.
  std::vector<std::uint8_t> is_true_;  // Per edge.
};

void expect_told_apart(const TownGraph& town, std::size_t num_true) {
  PoseGraph graph = town.graph;
  const std::vector<std::uint8_t> is_on = reject_outlier_edges(graph, {});
  EXPECT_EQ(town.count(is_on, false), 0u);
  EXPECT_GE(town.count(is_on, true), num_true * 95 / 100);
  const double error_without_false = town.error_with(town.is_true());
  EXPECT_LT(town.error_with(is_on), 1.2 * error_without_false);
}

TEST(OutlierEdges, Tells200FalseLoopsFrom500TrueOnes) {
  TownGraph town(1, true, 1000);
  town.add_true_loops(500);
  town.add_false_loops(200, 1);
  expect_told_apart(town, 500);
}

TEST(OutlierEdges, Tells200FalseLoopsFrom500TrueOnesWhereTheScaleIsFree) {
  TownGraph town(1, false, 700);
  town.add_true_loops(500);
  town.add_false_loops(200, 1);
  expect_told_apart(town, 500);
}

TEST(OutlierEdges, TellsFalseLoopsThatAgreeWithEachOther) {
  for (const bool is_metric : {true, false}) {
    TownGraph town(2, is_metric, 600);
    town.add_true_loops(100);
    town.add_false_loops(40, 10);
    expect_told_apart(town, 100);
  }
}

TEST(OutlierEdges, TellsFewTrueLoopsFromMoreFalseOnes) {
  TownGraph town(3, true, 600);
  town.add_true_loops(60);
  town.add_false_loops(150, 1);
  expect_told_apart(town, 60);
}

TEST(OutlierEdges, BelievesWhatNothingContradicts) {
  for (const bool is_metric : {true, false}) {
    TownGraph town(4, is_metric, 400);
    town.add_true_loops(1);
    PoseGraph graph = town.graph;
    EXPECT_EQ(reject_outlier_edges(graph, {}).back(), 1);
  }
}

TEST(OutlierEdges, ChangesItsMindAboutWhatWasBelieved) {
  TownGraph town(5, true, 400);
  town.add_false_loops(1, 1);
  const std::size_t believed = town.graph.edges.size() - 1;
  town.add_true_loops(30);
  PoseGraph graph = town.graph;
  const std::vector<std::uint8_t> is_on = reject_outlier_edges(graph, {.believed = {believed}});
  EXPECT_EQ(is_on[believed], 0);
  EXPECT_EQ(town.count(is_on, true), 30u);
}

TEST(OutlierEdges, GivesTheSameBitsAgain) {
  TownGraph town(6, false, 300);
  town.add_true_loops(30);
  town.add_false_loops(10, 1);
  PoseGraph a = town.graph, b = town.graph;
  EXPECT_EQ(reject_outlier_edges(a, {}), reject_outlier_edges(b, {}));
  for (std::size_t i = 0; i < a.node_from_world.size(); ++i) {
    EXPECT_EQ(a.node_from_world[i].translation, b.node_from_world[i].translation);
  }
}

TEST(OutlierEdges, SwitchesOffWhatIsNoMeasurement) {
  TownGraph town(7, true, 200);
  town.add_true_loops(3);
  PoseGraph graph = town.graph;
  graph.edges.back().to_from_from.translation.x() = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::uint8_t> is_on = reject_outlier_edges(graph, {});
  EXPECT_EQ(is_on.back(), 0);
  EXPECT_EQ(town.count(is_on, true), 2u);
  PoseGraph empty;
  EXPECT_TRUE(reject_outlier_edges(empty, {}).empty());
}

}  // namespace
}  // namespace waymark
