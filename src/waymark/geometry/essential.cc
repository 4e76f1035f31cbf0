// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/essential.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "waymark/geometry/polynomial.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

// --- Polynomials in the three unknowns x, y, z of E = x X + y Y + z Z + W ---

struct Monomial {
  int x, y, z;
};

constexpr std::array<Monomial, 4> kLinear = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
constexpr std::array<Monomial, 10> kQuadratic = {{{2, 0, 0},
                                                  {0, 2, 0},
                                                  {0, 0, 2},
                                                  {1, 1, 0},
                                                  {1, 0, 1},
                                                  {0, 1, 1},
                                                  {1, 0, 0},
                                                  {0, 1, 0},
                                                  {0, 0, 1},
                                                  {0, 0, 0}}};
// The order of Nister 2004, section 3.2: ten monomials to eliminate, then those whose degree in x
// and y together is at most one.
constexpr std::array<Monomial, 20> kCubic = {
    {{3, 0, 0}, {0, 3, 0}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}, {2, 0, 0}, {0, 2, 1},
     {0, 2, 0}, {1, 1, 1}, {1, 1, 0}, {1, 0, 2}, {1, 0, 1}, {1, 0, 0}, {0, 1, 2},
     {0, 1, 1}, {0, 1, 0}, {0, 0, 3}, {0, 0, 2}, {0, 0, 1}, {0, 0, 0}}};

// table[i][j] is the place of factors_a[i] * factors_b[j] among the products.
template <std::size_t kA, std::size_t kB, std::size_t kProducts>
constexpr std::array<std::array<int, kB>, kA> product_table(
    const std::array<Monomial, kA>& factors_a,
    const std::array<Monomial, kB>& factors_b,
    const std::array<Monomial, kProducts>& products) {
  std::array<std::array<int, kB>, kA> table{};
  for (std::size_t i = 0; i < kA; ++i) {
    for (std::size_t j = 0; j < kB; ++j) {
      for (std::size_t k = 0; k < kProducts; ++k) {
        if (factors_a[i].x + factors_b[j].x == products[k].x &&
            factors_a[i].y + factors_b[j].y == products[k].y &&
            factors_a[i].z + factors_b[j].z == products[k].z) {
          table[i][j] = static_cast<int>(k);
        }
      }
    }
  }
  return table;
}

constexpr auto kLinearTimesLinear = product_table(kLinear, kLinear, kQuadratic);
constexpr auto kQuadraticTimesLinear = product_table(kQuadratic, kLinear, kCubic);

using Linear = Eigen::Matrix<double, 4, 1>;
using Quadratic = Eigen::Matrix<double, 10, 1>;
using Cubic = Eigen::Matrix<double, 20, 1>;

Quadratic multiply(const Linear& a, const Linear& b) {
  Quadratic product = Quadratic::Zero();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) product[kLinearTimesLinear[i][j]] += a[i] * b[j];
  }
  return product;
}

Cubic multiply(const Quadratic& a, const Linear& b) {
  Cubic product = Cubic::Zero();
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 4; ++j) product[kQuadraticTimesLinear[i][j]] += a[i] * b[j];
  }
  return product;
}

// Columns X, Y, Z, W, orthonormal, span the matrices, as vectors of their rows, that satisfy the
// five epipolar constraints (Nister 2004, section 3).
using NullSpace = Eigen::Matrix<double, 9, 4>;

// Normally distributed numbers, of no further meaning.
constexpr std::array<std::array<double, 9>, 4> kGeneralPosition = {
    {{0.041, 0.465, -0.461, 0.353, 0.926, 0.411, 1.562, -0.885, 0.067},
     {-0.705, -0.784, -0.184, 0.221, 0.419, 0.508, 2.234, 0.863, -1.595},
     {0.204, -0.623, -0.516, 1.306, -0.223, -1.951, 0.311, -0.291, -1.174},
     {-0.921, -0.625, -0.023, -0.427, 0.071, 1.836, -0.800, -0.807, -0.249}}};

NullSpace epipolar_null_space(std::span<const Eigen::Vector3d, 5> bearings_a,
                              std::span<const Eigen::Vector3d, 5> bearings_b) {
  // Gram-Schmidt over the constraints and then four directions in general position. Directions
  // along the axes would not do: without rotation, as on a straight road, the essential matrix is
  // skew-symmetric, and in a basis of matching structure two solutions share the same z.
  Eigen::Matrix<double, 9, 9> basis;
  for (int i = 0; i < 9; ++i) {
    Eigen::Matrix<double, 9, 1> column;
    for (int k = 0; k < 9; ++k) {
      column[k] = i < 5 ? bearings_b[i][k / 3] * bearings_a[i][k % 3]
                        : kGeneralPosition[static_cast<std::size_t>(i - 5)][k];
    }
    for (int pass = 0; pass < 2; ++pass) {  // Twice is enough (Kahan).
      for (int j = 0; j < i; ++j) column -= basis.col(j).dot(column) * basis.col(j);
    }
    basis.col(i) = column.normalized();
  }
  return basis.rightCols<4>();
}

// The ten cubics that make xX + yY + zZ + W an essential matrix: rows are
// E E^T E - 1/2 trace(E E^T) E = 0 (Nister 2004, eq. 3) and det E = 0 (eq. 2).
Eigen::Matrix<double, 10, 20> essential_constraints(const NullSpace& basis) {
  const auto e = [&](int row, int column) -> Linear {
    return basis.row(3 * row + column).transpose();
  };
  std::array<std::array<Quadratic, 3>, 3> gram;  // E E^T - 1/2 trace(E E^T)
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      gram[i][j] =
          multiply(e(i, 0), e(j, 0)) + multiply(e(i, 1), e(j, 1)) + multiply(e(i, 2), e(j, 2));
      gram[j][i] = gram[i][j];
    }
  }
  const Quadratic half_trace = 0.5 * (gram[0][0] + gram[1][1] + gram[2][2]);
  for (int i = 0; i < 3; ++i) gram[i][i] -= half_trace;

  Eigen::Matrix<double, 10, 20> constraints;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      constraints.row(3 * i + j) = (multiply(gram[i][0], e(0, j)) + multiply(gram[i][1], e(1, j)) +
                                    multiply(gram[i][2], e(2, j)))
                                       .transpose();
    }
  }
  const auto minor = [&](int column, int other) -> Quadratic {
    return multiply(e(0, column), e(1, other)) - multiply(e(0, other), e(1, column));
  };
  constraints.row(9) = (multiply(minor(1, 2), e(2, 0)) + multiply(minor(2, 0), e(2, 1)) +
                        multiply(minor(0, 1), e(2, 2)))
                           .transpose();
  return constraints;
}

// Gauss-Jordan elimination with partial pivoting: the last ten columns once the first ten are the
// identity.
Eigen::Matrix<double, 10, 10> eliminate(Eigen::Matrix<double, 10, 20> system) {
  for (int column = 0; column < 10; ++column) {
    int pivot = column;
    for (int row = column + 1; row < 10; ++row) {
      if (std::abs(system(row, column)) > std::abs(system(pivot, column))) pivot = row;
    }
    const int num_left = 20 - column;
    system.row(column).swap(system.row(pivot));
    const double pivot_value = system(column, column);
    system.row(column).tail(num_left) /= pivot_value;
    for (int row = 0; row < 10; ++row) {
      if (row == column) continue;
      const double factor = system(row, column);
      system.row(row).tail(num_left) -= factor * system.row(column).tail(num_left);
    }
  }
  return system.rightCols<10>();
}

// --- Polynomials in z alone, ascending ---

using PolynomialInZ = Eigen::Matrix<double, 11, 1>;

PolynomialInZ multiply(const PolynomialInZ& a, int degree_a, const PolynomialInZ& b, int degree_b) {
  PolynomialInZ product = PolynomialInZ::Zero();
  for (int i = 0; i <= degree_a; ++i) {
    product.segment(i, degree_b + 1) += a[i] * b.head(degree_b + 1);
  }
  return product;
}

// B(z) * (x, y, 1)^T = 0 with polynomials of degrees 3, 3, 4 in its columns.
using MatrixInZ = std::array<std::array<PolynomialInZ, 3>, 3>;

// Rows 4 to 9 of the eliminated system begin with x^2 z, x^2, y^2 z, y^2, xyz, xy: each pair, the
// first minus z times the second, leaves only terms of degree one in x and y.
MatrixInZ eliminate_products(const Eigen::Matrix<double, 10, 10>& reduced) {
  MatrixInZ matrix;
  for (int pair = 0; pair < 3; ++pair) {
    const auto first = reduced.row(4 + 2 * pair);
    const auto second = reduced.row(5 + 2 * pair);
    int offset = 0;
    for (int column = 0; column < 3; ++column) {
      const int num_terms = column < 2 ? 3 : 4;  // z^2, z, 1 of x and y; z^3, z^2, z, 1
      PolynomialInZ& entry = matrix[pair][column];
      entry.setZero();
      for (int term = 0; term < num_terms; ++term) {
        const int power = num_terms - 1 - term;
        entry[power] += first[offset + term];
        entry[power + 1] -= second[offset + term];
      }
      offset += num_terms;
    }
  }
  return matrix;
}

// Of degree ten.
PolynomialInZ determinant(const MatrixInZ& m) {
  const auto minor = [&](int i, int j, int degree_i, int degree_j) -> PolynomialInZ {
    return multiply(m[0][i], degree_i, m[1][j], degree_j) -
           multiply(m[0][j], degree_j, m[1][i], degree_i);
  };
  return multiply(minor(1, 2, 3, 4), 7, m[2][0], 3) + multiply(minor(2, 0, 4, 3), 7, m[2][1], 3) +
         multiply(minor(0, 1, 3, 3), 6, m[2][2], 4);
}

// The null vector (x, y, 1) of B(z), scaled freely: the longest cross product of two rows.
Eigen::Vector3d null_vector(const MatrixInZ& matrix, double z) {
  Eigen::Matrix3d value;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double sum = 0.0;
      for (int power = 4; power >= 0; --power) sum = sum * z + matrix[i][j][power];
      value(i, j) = sum;
    }
    value.row(i).normalize();
  }
  Eigen::Vector3d longest = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d product = value.row(i).cross(value.row((i + 1) % 3));
    if (product.squaredNorm() > longest.squaredNorm()) longest = product;
  }
  return longest;
}

using EssentialVector = Eigen::Matrix<double, 9, 1>;
using RowMajorMatrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Constraints = Eigen::Matrix<double, 10, 1>;

/// The ten constraints above at a matrix, and their derivative by a change of it.
Constraints constraints_at(const Eigen::Matrix3d& e) {
  Constraints values;
  const Eigen::Matrix3d gram = e * e.transpose();
  Eigen::Map<Eigen::Matrix3d>(values.data()) = gram * e - 0.5 * gram.trace() * e;
  values[9] = e.col(0).dot(e.col(1).cross(e.col(2)));
  return values;
}

Constraints constraints_derivative(const Eigen::Matrix3d& e, const Eigen::Matrix3d& change) {
  Constraints values;
  const Eigen::Matrix3d gram = e * e.transpose();
  const Eigen::Matrix3d half = change * e.transpose();
  const Eigen::Matrix3d gram_change = half + half.transpose();
  Eigen::Map<Eigen::Matrix3d>(values.data()) =
      gram_change * e + gram * change - 0.5 * gram_change.trace() * e - 0.5 * gram.trace() * change;
  values[9] = change.col(0).dot(e.col(1).cross(e.col(2))) +
              change.col(1).dot(e.col(2).cross(e.col(0))) +
              change.col(2).dot(e.col(0).cross(e.col(1)));
  return values;
}

// Takes back the digits that the elimination loses, most of all without rotation and past a plane:
// Gauss-Newton on the constraints themselves, over the unit vectors of coordinates in the basis.
EssentialVector polish(const NullSpace& basis, const Eigen::Vector4d& coordinates) {
  constexpr int kMaxSteps = 3;
  Eigen::Vector4d c = coordinates.normalized();
  EssentialVector entries = basis * c;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::Matrix3d e = Eigen::Map<const RowMajorMatrix>(entries.data());
    Eigen::Matrix<double, 10, 4> jacobian;
    for (int k = 0; k < 4; ++k) {
      const EssentialVector direction = basis.col(k);
      jacobian.col(k) =
          constraints_derivative(e, Eigen::Map<const RowMajorMatrix>(direction.data()));
    }
    // Along c itself nothing changes but the length.
    const Eigen::Matrix4d normal = jacobian.transpose() * jacobian + c * c.transpose();
    const Eigen::Vector4d change = normal.ldlt().solve(jacobian.transpose() * constraints_at(e));
    if (!(change.squaredNorm() < 1e-2)) break;
    c = (c - change).normalized();
    entries = basis * c;
    if (change.squaredNorm() < 1e-24) break;
  }
  return entries;
}

}  // namespace

Eigen::Matrix3d essential_from_pose(const Rigid3& b_from_a) {
  return skew(b_from_a.translation.normalized()) * b_from_a.rotation_matrix();
}

std::vector<Eigen::Matrix3d> solve_five_point(std::span<const Eigen::Vector3d, 5> bearings_a,
                                              std::span<const Eigen::Vector3d, 5> bearings_b) {
  const NullSpace basis = epipolar_null_space(bearings_a, bearings_b);
  const Eigen::Matrix<double, 10, 10> reduced = eliminate(essential_constraints(basis));
  if (!reduced.allFinite()) return {};
  const MatrixInZ matrix = eliminate_products(reduced);
  const PolynomialInZ polynomial = determinant(matrix);

  std::vector<Eigen::Matrix3d> essentials;
  essentials.reserve(kMaxPolynomialDegree);
  for (const double z : real_roots({polynomial.data(), 11})) {
    const Eigen::Vector3d xy1 = null_vector(matrix, z);
    const Eigen::Vector4d coordinates(xy1.x(), xy1.y(), xy1.z() * z, xy1.z());
    if (!(coordinates.norm() > 0.0) || !coordinates.allFinite()) continue;
    const EssentialVector entries = polish(basis, coordinates);
    essentials.emplace_back(std::numbers::sqrt2 * Eigen::Map<const RowMajorMatrix>(entries.data()));
  }
  return essentials;
}

std::array<Rigid3, 4> decompose_essential(const Eigen::Matrix3d& essential) {
  // t t^T = 1/2 trace(E E^T) I - E E^T (Horn 1990): take the column of the largest square.
  const Eigen::Matrix3d gram = essential * essential.transpose();
  const Eigen::Matrix3d t_squared = 0.5 * gram.trace() * Eigen::Matrix3d::Identity() - gram;
  int largest = 0;
  t_squared.diagonal().maxCoeff(&largest);
  const Eigen::Vector3d t = t_squared.col(largest).normalized();

  // |t|^2 R = cofactors(E) - skew(t) E, and the same with -t.
  Eigen::Matrix3d cofactors;
  cofactors << essential.col(1).cross(essential.col(2)), essential.col(2).cross(essential.col(0)),
      essential.col(0).cross(essential.col(1));
  const double scale = std::sqrt(0.5 * gram.trace());
  cofactors /= scale * scale;
  const Eigen::Matrix3d turned = skew(t) * essential / scale;
  const Eigen::Quaterniond q(Eigen::Matrix3d(cofactors - turned));
  const Eigen::Quaterniond twisted(Eigen::Matrix3d(cofactors + turned));
  return {Rigid3(q.normalized(), t),
          Rigid3(q.normalized(), -t),
          Rigid3(twisted.normalized(), t),
          Rigid3(twisted.normalized(), -t)};
}

}  // namespace waymark
