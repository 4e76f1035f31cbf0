// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/optimize/pose_graph.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "waymark/base/check.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/solver/testing/scene.h"

namespace waymark {
namespace {

using testing::random_vector;

Sim3 random_sim3(Rng& rng, double sigma, double sigma_log_scale) {
  Vector7d tangent;
  tangent << random_vector(rng, sigma), random_vector(rng, sigma), sigma_log_scale * rng.normal();
  return Sim3::exp(tangent);
}

Eigen::Vector3d position(const Sim3& node_from_world) {
  return node_from_world.inverse().translation;
}

/// Places on a circle of 10 m radius, the camera looking ahead.
std::vector<Sim3> make_circle(std::size_t num_nodes) {
  std::vector<Sim3> node_from_world;
  for (std::size_t i = 0; i < num_nodes; ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(num_nodes);
    const Eigen::Vector3d centre(10.0 * std::cos(angle), 0.0, 10.0 * std::sin(angle));
    const Rigid3 world_from_node(so3_exp({0.0, -angle, 0.0}), centre);
    node_from_world.emplace_back(world_from_node.inverse());
  }
  return node_from_world;
}

PoseGraphEdge make_edge(std::span<const Sim3> node_from_world, std::size_t from, std::size_t to) {
  PoseGraphEdge edge;
  edge.from = static_cast<std::uint32_t>(from);
  edge.to = static_cast<std::uint32_t>(to);
  edge.to_from_from = node_from_world[to] * node_from_world[from].inverse();
  edge.sigma_translation = 0.02;
  edge.sigma_rotation_rad = 0.002;
  edge.sigma_log_scale = 0.004;
  return edge;
}

/// A graph like that of a map that drifted on its way round: neighbours up to three apart agree
/// with the drifted map, loops agree with the truth.
struct Drift {
  std::vector<Sim3> truth;  ///< Its scales are the units that the map has at each node.
  PoseGraph graph;
};

constexpr double kLogScaleOfRound = -0.35;

Drift make_drift(std::size_t num_nodes, bool is_scale_free) {
  Drift drift;
  const std::vector<Sim3> circle = make_circle(num_nodes);
  const double share = 1.0 / static_cast<double>(num_nodes);
  // Over the round the map shrinks by 30 %, turns by 0.2 rad and sinks by a metre.
  Vector6d per_step;
  per_step << 0.0, share, 0.0, 0.02 * share, 0.2 * share, 0.0;
  auto& nodes = drift.graph.node_from_world;
  for (std::size_t i = 0; i < num_nodes; ++i) {
    const double log_units = is_scale_free ? kLogScaleOfRound * share * static_cast<double>(i) : 0;
    const Sim3 units(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), std::exp(log_units));
    drift.truth.push_back(units * circle[i]);
    if (i == 0) {
      nodes.push_back(circle[0]);
      continue;
    }
    const Sim3 step = circle[i] * circle[i - 1].inverse();
    const Rigid3 in_map_units(step.rotation, units.scale * step.translation);
    nodes.push_back(Sim3(Rigid3::exp(per_step) * in_map_units) * nodes.back());
  }
  for (std::size_t i = 0; i < num_nodes; ++i) {
    for (std::size_t j = i + 1; j < std::min(i + 4, num_nodes); ++j) {
      drift.graph.edges.push_back(make_edge(nodes, i, j));
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    drift.graph.edges.push_back(make_edge(drift.truth, num_nodes - 1 - i, i));
    drift.graph.edges.back().is_robust = true;
  }
  drift.graph.is_fixed.assign(num_nodes, 0);
  drift.graph.is_fixed[0] = 1;
  drift.graph.is_scale_free = is_scale_free;
  return drift;
}

double largest_error(const PoseGraph& graph, std::span<const Sim3> truth) {
  double largest = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    largest = std::max(largest, (position(graph.node_from_world[i]) - position(truth[i])).norm());
  }
  return largest;
}

/// Length of an edge's residual in standard deviations.
double gap(const PoseGraph& graph, const PoseGraphEdge& edge) {
  const auto& nodes = graph.node_from_world;
  return pose_graph_residual(edge, nodes[edge.from], nodes[edge.to]).value.norm();
}

TEST(PoseGraph, JacobiansMatchNumericDerivatives) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    Rng rng(seed, 1);
    const double size = seed % 3 == 0 ? 0.01 : 0.7;
    const Sim3 from = random_sim3(rng, 1.0, 0.5), to = random_sim3(rng, 1.0, 0.5);
    PoseGraphEdge edge;
    edge.to_from_from = random_sim3(rng, size, size) * to * from.inverse();
    edge.sigma_translation = 0.5;
    edge.sigma_rotation_rad = 0.2;
    edge.sigma_log_scale = 2.0;
    const PoseGraphResidual residual = pose_graph_residual(edge, from, to);
    const double step = 1e-5;
    for (int k = 0; k < 7; ++k) {
      const Sim3 plus = Sim3::exp(step * Vector7d::Unit(k)), minus = plus.inverse();
      const Vector7d by_from = (pose_graph_residual(edge, plus * from, to).value -
                                pose_graph_residual(edge, minus * from, to).value) /
                               (2.0 * step);
      const Vector7d by_to = (pose_graph_residual(edge, from, plus * to).value -
                              pose_graph_residual(edge, from, minus * to).value) /
                             (2.0 * step);
      EXPECT_LT((residual.by_from.col(k) - by_from).norm(), 1e-6 * (1.0 + by_from.norm())) << seed;
      EXPECT_LT((residual.by_to.col(k) - by_to).norm(), 1e-6 * (1.0 + by_to.norm())) << seed;
    }
  }
}

TEST(PoseGraph, ConsistentMeasurementsAreMetExactly) {
  for (const bool is_scale_free : {true, false}) {
    Rng rng(2, is_scale_free);
    const std::vector<Sim3> truth = make_circle(40);
    PoseGraph graph;
    graph.is_scale_free = is_scale_free;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      graph.is_fixed.push_back(i == 7);
      graph.node_from_world.push_back(
          i == 7 ? truth[i] : random_sim3(rng, 0.2, is_scale_free ? 0.2 : 0.0) * truth[i]);
      graph.edges.push_back(make_edge(truth, i, (i + 1) % truth.size()));
    }
    const auto summary = optimize_pose_graph(graph, {});
    EXPECT_TRUE(summary.is_converged);
    EXPECT_GT(summary.initial_cost, 1e3);
    EXPECT_LT(summary.final_cost, 1e-9);
    EXPECT_LT(largest_error(graph, truth), 1e-6);
  }
}

TEST(PoseGraph, ClosesALoopThatDriftedInScale) {
  Drift drift = make_drift(300, true);
  const double before = largest_error(drift.graph, drift.truth);
  const double gap_before = gap(drift.graph, drift.graph.edges.back());
  EXPECT_GT(before, 2.0);
  const auto summary = optimize_pose_graph(drift.graph, {});
  EXPECT_TRUE(summary.is_converged);
  EXPECT_LT(gap(drift.graph, drift.graph.edges.back()), 0.03 * gap_before);
  EXPECT_LT(largest_error(drift.graph, drift.truth), 0.1 * before);
  // The drift of scale is spread: what the last nodes' units are worth.
  const Sim3& last = drift.graph.node_from_world.back();
  EXPECT_NEAR(std::log(last.scale), kLogScaleOfRound, 0.02);
  EXPECT_NEAR(std::log(drift.graph.node_from_world[150].scale), 0.5 * kLogScaleOfRound, 0.02);
}

TEST(PoseGraph, ClosesAMetricLoopAndKeepsScales) {
  Drift drift = make_drift(300, false);
  const double before = largest_error(drift.graph, drift.truth);
  const auto summary = optimize_pose_graph(drift.graph, {});
  EXPECT_TRUE(summary.is_converged);
  EXPECT_LT(largest_error(drift.graph, drift.truth), 0.3 * before);
  for (const Sim3& node : drift.graph.node_from_world) EXPECT_EQ(node.scale, 1.0);
}

TEST(PoseGraph, DiscountsAFalseLoop) {
  Drift drift = make_drift(120, true);
  Drift deceived = drift;
  PoseGraphEdge loop = make_edge(drift.truth, 60, 18);
  loop.to_from_from.translation.setZero();
  loop.is_robust = true;
  deceived.graph.edges.push_back(loop);
  Drift trusting = deceived;
  for (PoseGraphEdge& edge : trusting.graph.edges) edge.is_robust = false;
  for (Drift* each : {&drift, &deceived, &trusting}) optimize_pose_graph(each->graph, {});
  const double error = largest_error(drift.graph, drift.truth);
  EXPECT_LT(largest_error(deceived.graph, drift.truth), error + 2.0);
  EXPECT_GT(largest_error(trusting.graph, drift.truth), error + 4.0);
}

/// Autodiff residual with its own formulas: parameters (angle axis, translation, log scale); the
/// integral of the exponential by its power series.
struct Oracle {
  PoseGraphEdge edge;

  template <class T>
  using Matrix3 = Eigen::Matrix<T, 3, 3>;
  template <class T>
  using Vector3 = Eigen::Matrix<T, 3, 1>;

  template <class T>
  static Matrix3<T> rotation(const T* angle_axis) {
    Matrix3<T> result;
    ceres::AngleAxisToRotationMatrix(angle_axis, result.data());
    return result;
  }

  template <class T>
  bool operator()(const T* from, const T* to, T* residual) const {
    using std::exp;
    const Eigen::Matrix3d measured = edge.to_from_from.rotation.toRotationMatrix();
    const Matrix3<T> rotation_from = rotation(from), rotation_to = rotation(to);
    const Matrix3<T> turn = measured.cast<T>() * rotation_from * rotation_to.transpose();
    const T log_scale = std::log(edge.to_from_from.scale) + from[6] - to[6];
    const Vector3<T> t_from(from[3], from[4], from[5]), t_to(to[3], to[4], to[5]);
    const Vector3<T> moved = T(edge.to_from_from.scale) * (measured.cast<T>() * t_from) +
                             edge.to_from_from.translation.cast<T>();
    const Vector3<T> t = moved - exp(log_scale) * (turn * t_to);
    T phi[3];
    ceres::RotationMatrixToAngleAxis(turn.data(), phi);
    Matrix3<T> generator;
    generator << log_scale, -phi[2], phi[1], phi[2], log_scale, -phi[0], -phi[1], phi[0], log_scale;
    Matrix3<T> sum = Matrix3<T>::Identity(), term = Matrix3<T>::Identity();
    for (int n = 1; n < 24; ++n) {
      term = (term * generator / T(n + 1)).eval();
      sum += term;
    }
    const Vector3<T> rho = sum.inverse() * t;
    for (int i = 0; i < 3; ++i) {
      residual[i] = rho[i] / edge.sigma_translation;
      residual[3 + i] = phi[i] / edge.sigma_rotation_rad;
    }
    residual[6] = log_scale / edge.sigma_log_scale;
    return true;
  }
};

double cost_by_ceres(const PoseGraph& graph, double robust_scale) {
  std::vector<std::array<double, 7>> parameters(graph.node_from_world.size());
  ceres::Problem problem;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Sim3& node = graph.node_from_world[i];
    Eigen::Map<Eigen::Vector3d>(parameters[i].data()) = so3_log(node.rotation);
    Eigen::Map<Eigen::Vector3d>(parameters[i].data() + 3) = node.translation;
    parameters[i][6] = std::log(node.scale);
    problem.AddParameterBlock(parameters[i].data(), 7);
    if (!graph.is_scale_free || (!graph.keeps_scale.empty() && graph.keeps_scale[i])) {
      problem.SetManifold(parameters[i].data(), new ceres::SubsetManifold(7, {6}));
    }
    if (graph.is_fixed[i]) problem.SetParameterBlockConstant(parameters[i].data());
  }
  for (const PoseGraphEdge& edge : graph.edges) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Oracle, 7, 7, 7>(new Oracle{edge}),
                             edge.is_robust ? new ceres::HuberLoss(robust_scale) : nullptr,
                             parameters[edge.from].data(),
                             parameters[edge.to].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = options.parameter_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.final_cost;
}

TEST(PoseGraph, AgreesWithCeresInCost) {
  for (const bool is_scale_free : {true, false}) {
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      Rng rng(seed, 3);
      Drift drift = make_drift(36, is_scale_free);
      for (PoseGraphEdge& edge : drift.graph.edges) {
        edge.to_from_from =
            random_sim3(rng, 0.003, is_scale_free ? 0.003 : 0.0) * edge.to_from_from;
      }
      // One loop contradicts the others.
      drift.graph.edges.back().to_from_from.translation.y() += 0.5;
      drift.graph.is_fixed[20] = seed == 1;
      const double expected = cost_by_ceres(drift.graph, PoseGraphOptions().robust_scale);
      const auto summary = optimize_pose_graph(drift.graph, {});
      EXPECT_TRUE(summary.is_converged);
      EXPECT_GT(expected, 10.0);
      EXPECT_NEAR(summary.final_cost, expected, 1e-6 * expected) << is_scale_free << seed;
    }
  }
}

TEST(PoseGraph, KeepsTheScaleOfSomeNodes) {
  Drift drift = make_drift(36, true);
  const std::vector<Sim3> before = drift.graph.node_from_world;
  for (std::size_t i = 0; i < 36; ++i) drift.graph.keeps_scale.push_back(i % 3 == 1);
  const double expected = cost_by_ceres(drift.graph, PoseGraphOptions().robust_scale);
  EXPECT_NEAR(optimize_pose_graph(drift.graph, {}).final_cost, expected, 1e-6 * expected);
  for (std::size_t i = 1; i < 36; ++i) {
    EXPECT_EQ(drift.graph.node_from_world[i].scale == before[i].scale, i % 3 == 1) << i;
  }
}

bool is_finite(const PoseGraph& graph) {
  for (const Sim3& node : graph.node_from_world) {
    const bool is_good = node.translation.allFinite() && node.rotation.coeffs().allFinite() &&
                         std::isfinite(node.scale) && node.scale > 0.0;
    if (!is_good) return false;
  }
  return true;
}

TEST(PoseGraph, LeavesOutWhatCannotBeUsed) {
  Drift drift = make_drift(50, true);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto add = [&](auto&& spoil) {
    PoseGraphEdge edge = make_edge(drift.truth, 10, 30);
    spoil(edge);
    drift.graph.edges.push_back(edge);
  };
  add([&](PoseGraphEdge& edge) { edge.to_from_from.translation.x() = nan; });
  add([&](PoseGraphEdge& edge) { edge.to_from_from.rotation.coeffs().setZero(); });
  add([&](PoseGraphEdge& edge) { edge.to_from_from.scale = -1.0; });
  add([&](PoseGraphEdge& edge) { edge.sigma_rotation_rad = 0.0; });
  add([&](PoseGraphEdge& edge) { edge.sigma_translation = nan; });
  add([&](PoseGraphEdge& edge) { edge.sigma_translation = 1e-200; });
  add([&](PoseGraphEdge& edge) { edge.from = edge.to; });
  PoseGraph clean = drift.graph;
  clean.edges.resize(clean.edges.size() - 7);
  const auto summary = optimize_pose_graph(drift.graph, {});
  EXPECT_EQ(summary.num_unused_edges, 7u);
  EXPECT_EQ(summary.final_cost, optimize_pose_graph(clean, {}).final_cost);
  EXPECT_TRUE(is_finite(drift.graph));
}

TEST(PoseGraph, StaysFiniteOnHostileInput) {
  Rng rng(5, 0);
  for (int run = 0; run < 8; ++run) {
    Drift drift = make_drift(20, run % 2 == 0);
    for (PoseGraphEdge& edge : drift.graph.edges) {
      const double size = std::pow(10.0, rng.uniform(-3.0, 3.0));
      edge.to_from_from = random_sim3(rng, size, run % 2 == 0 ? 2.0 : 0.0);
      edge.sigma_rotation_rad = std::pow(10.0, rng.uniform(-8.0, 2.0));
    }
    const auto summary = optimize_pose_graph(drift.graph, {});
    EXPECT_TRUE(is_finite(drift.graph)) << run;
    EXPECT_LE(summary.final_cost, summary.initial_cost);
  }
  PoseGraph empty;
  EXPECT_EQ(optimize_pose_graph(empty, {}).num_iterations, 0);
}

TEST(PoseGraph, LonelyAndFixedNodesStayToTheBit) {
  Drift drift = make_drift(50, true);
  drift.graph.is_fixed[25] = 1;
  drift.graph.node_from_world.push_back(Sim3(Eigen::Quaterniond::Identity(), {1, 2, 3}, 2.0));
  drift.graph.is_fixed.push_back(0);
  const PoseGraph before = drift.graph;
  optimize_pose_graph(drift.graph, {});
  for (const std::size_t node : {0u, 25u, 50u}) {
    const Sim3 &is = drift.graph.node_from_world[node], &was = before.node_from_world[node];
    EXPECT_EQ(is.rotation.coeffs(), was.rotation.coeffs());
    EXPECT_EQ(is.translation, was.translation);
    EXPECT_EQ(is.scale, was.scale);
  }
}

TEST(PoseGraph, WithoutAFixedNodeItStaysAboutWhereItIs) {
  Drift drift = make_drift(50, true);
  Drift free = drift;
  free.graph.is_fixed[0] = 0;
  const double expected = optimize_pose_graph(drift.graph, {}).final_cost;
  const auto summary = optimize_pose_graph(free.graph, {});
  EXPECT_NEAR(summary.final_cost, expected, 1e-6 * expected + 1e-9);
  for (const Sim3& node : free.graph.node_from_world) EXPECT_LT(position(node).norm(), 20.0);
}

TEST(PoseGraph, GivesTheSameBitsTwice) {
  Drift first = make_drift(80, true), second = first;
  optimize_pose_graph(first.graph, {});
  optimize_pose_graph(second.graph, {});
  for (std::size_t i = 0; i < first.truth.size(); ++i) {
    EXPECT_EQ(first.graph.node_from_world[i].translation,
              second.graph.node_from_world[i].translation);
    EXPECT_EQ(first.graph.node_from_world[i].scale, second.graph.node_from_world[i].scale);
  }
}

TEST(PoseGraph, AnEdgeToAnUnknownNodeIsABrokenPromise) {
  Drift drift = make_drift(10, true);
  drift.graph.edges[0].to = 10;
  EXPECT_THROW(optimize_pose_graph(drift.graph, {}), CheckError);
}

}  // namespace
}  // namespace waymark
