// Linear problems on sets of voxels, for tests and benchmarks of the linear solver: the stiffness at rest of
// the model `cells` (mean deformation gradient and hourglass connections), with supports by penalty as
// simulate makes them.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <tuple>
#include <vector>

#include "simulate/linear/block_jacobi.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/free_motions.h"
#include "simulate/linear/multigrid.h"
#include "simulate/linear/preconditioner.h"

namespace flexel::simulate::test {

struct Voxel {
  Index3 at{};
  double fill = 1;
  double modulus = 1;  // Young's modulus, Pa
  std::uint32_t part = 0;
};

struct VoxelProblem {
  double spacing = 1;  // m
  std::vector<Voxel> voxels;
  std::vector<std::array<std::uint32_t, 8>> corners;  // (voxels x 8) rows of the matrix
  BlockMatrix matrix;
  NodeGeometry geometry;
  std::vector<Vec3> load;  // (rows x 3) N
};

using CellMatrix = Eigen::Matrix<double, 24, 24>;

// Stiffness of a whole cell of spacing h and unit modulus: h^3 B^T C B from the mean strain, plus (c / 64)
// s_ma s_mb for the four hourglass modes m, c = 8/3 mu h.
inline CellMatrix cell_stiffness(double h, double poisson) {
  const double lambda = poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = .5 / (1 + poisson);
  Eigen::Matrix<double, 6, 6> elasticity = Eigen::Matrix<double, 6, 6>::Zero();
  elasticity.topLeftCorner<3, 3>().setConstant(lambda);
  elasticity.diagonal() << lambda + 2 * mu, lambda + 2 * mu, lambda + 2 * mu, mu, mu, mu;
  Eigen::Matrix<double, 6, 24> strain = Eigen::Matrix<double, 6, 24>::Zero();
  std::array<std::array<double, 3>, 8> sign{};
  for (int a = 0; a < 8; ++a) {
    for (int j = 0; j < 3; ++j) sign[a][j] = (a >> j & 1) ? 1 : -1;
    const Vec3 g = Vec3(sign[a][0], sign[a][1], sign[a][2]) / (4 * h);
    strain.block<6, 3>(0, 3 * a) << g[0], 0, 0, 0, g[1], 0, 0, 0, g[2], g[1], g[0], 0, 0, g[2], g[1], g[2], 0,
        g[0];
  }
  CellMatrix stiffness = h * h * h * strain.transpose() * elasticity * strain;
  for (int a = 0; a < 8; ++a) {
    for (int b = 0; b < 8; ++b) {
      double product = 0;
      for (int m : {3, 5, 6, 7}) {
        double s = 1, t = 1;
        for (int j = 0; j < 3; ++j) {
          if (m >> j & 1) {
            s *= sign[a][j];
            t *= sign[b][j];
          }
        }
        product += s * t;
      }
      stiffness.block<3, 3>(3 * a, 3 * b).diagonal().array() += 8. / 3 * mu * h / 64 * product;
    }
  }
  return stiffness;
}

// Adds `block` at (row, column), which the pattern has.
inline void add_block(BlockMatrix& matrix, std::uint32_t row, std::uint32_t column, const Mat3& block) {
  const auto begin = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[row]);
  const auto end = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[row + 1]);
  matrix.values[std::lower_bound(begin, end, column) - matrix.columns.begin()] += block;
}

// Numbers the nodes by (part, k, j, i), assembles the stiffness; no supports, no load.
inline VoxelProblem assemble(std::vector<Voxel> voxels, double spacing = 1, double poisson = .3) {
  VoxelProblem problem;
  problem.spacing = spacing;
  using Key = std::tuple<std::uint32_t, int, int, int>;
  const auto key = [](const Voxel& v, int a) {
    return Key{v.part, v.at[2] + (a >> 2), v.at[1] + (a >> 1 & 1), v.at[0] + (a & 1)};
  };
  std::vector<Key> keys;
  for (const Voxel& v : voxels) {
    for (int a = 0; a < 8; ++a) keys.push_back(key(v, a));
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  for (const auto& [part, k, j, i] : keys) {
    problem.geometry.part.push_back(part);
    problem.geometry.index.push_back({i, j, k});
    problem.geometry.position.push_back(spacing * Vec3(i, j, k));
  }
  problem.corners.resize(voxels.size());
  std::vector<std::vector<std::uint32_t>> rows(keys.size());
  for (std::size_t c = 0; c < voxels.size(); ++c) {
    for (int a = 0; a < 8; ++a) {
      problem.corners[c][a] = static_cast<std::uint32_t>(
          std::lower_bound(keys.begin(), keys.end(), key(voxels[c], a)) - keys.begin());
    }
    for (std::uint32_t a : problem.corners[c])
      rows[a].insert(rows[a].end(), problem.corners[c].begin(), problem.corners[c].end());
  }
  BlockMatrix& matrix = problem.matrix;
  matrix.row_offsets.assign(1, 0);
  for (auto& row : rows) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    matrix.columns.insert(matrix.columns.end(), row.begin(), row.end());
    matrix.row_offsets.push_back(matrix.columns.size());
    row = {};
  }
  matrix.values.assign(matrix.columns.size(), Block::Zero());
  const CellMatrix unit = cell_stiffness(spacing, poisson);
  for (std::size_t c = 0; c < voxels.size(); ++c) {
    const double scale = voxels[c].fill * voxels[c].modulus;
    for (int a = 0; a < 8; ++a) {
      for (int b = 0; b < 8; ++b) {
        add_block(matrix, problem.corners[c][a], problem.corners[c][b],
                  scale * unit.block<3, 3>(3 * a, 3 * b));
      }
    }
  }
  problem.load.assign(keys.size(), Vec3::Zero());
  problem.voxels = std::move(voxels);
  return problem;
}

// Supports the low face along `axis` of every voxel that `where` chooses to the ground: 300 E / h per unit area,
// 2 x 2 Gauss points.
inline void clamp_low_faces(VoxelProblem& problem, int axis, const std::function<bool(const Voxel&)>& where) {
  for (std::size_t c = 0; c < problem.voxels.size(); ++c) {
    if (!where(problem.voxels[c])) continue;
    const double penalty = 300 * problem.voxels[c].modulus * problem.spacing;  // (E / h) h^2
    for (int a = 0; a < 8; ++a) {
      for (int b = 0; b < 8; ++b) {
        if ((a >> axis & 1) || (b >> axis & 1)) continue;
        const int apart = ((a ^ b) & 1) + ((a ^ b) >> 1 & 1) + ((a ^ b) >> 2 & 1);
        const double mass = (apart == 0 ? 4 : apart == 1 ? 2 : 1) / 36.;  // of the bilinear face
        add_block(problem.matrix, problem.corners[c][a], problem.corners[c][b],
                  penalty * mass * Mat3::Identity());
      }
    }
  }
}

// Spreads `force` over the nodes that `where` chooses.
inline void push(VoxelProblem& problem, const Vec3& force, const std::function<bool(const Index3&)>& where) {
  double count = 0;
  for (const Index3& index : problem.geometry.index) count += where(index);
  for (std::size_t i = 0; i < problem.load.size(); ++i) {
    if (where(problem.geometry.index[i])) problem.load[i] += force / count;
  }
}

// Voxels of an nx x ny x nz box whose centre `inside` accepts.
inline std::vector<Voxel> carve(const Index3& size, const std::function<bool(const Vec3&)>& inside = {}) {
  std::vector<Voxel> voxels;
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        if (!inside || inside(Vec3(i + .5, j + .5, k + .5))) voxels.push_back({{i, j, k}});
      }
    }
  }
  return voxels;
}

// Voxels of a helical spring about z of `turns` coils: wire of diameter `wire`, mean coil radius `radius`,
// `pitch` per turn, all in voxels. Its lowest point is at z = 0 or a little above.
inline std::vector<Voxel> helical_spring(double radius, double wire, double pitch, double turns) {
  const double half = .5 * wire, middle = radius + half + 1, height = turns * pitch + wire;
  const int width = static_cast<int>(std::ceil(2 * middle));
  return carve({width, width, static_cast<int>(std::ceil(height))}, [=](const Vec3& x) {
    const double angle = std::atan2(x[1] - middle, x[0] - middle) / (2 * std::numbers::pi);
    const double off = std::hypot(x[0] - middle, x[1] - middle) - radius;
    const double coil = std::round((x[2] - half) / pitch - angle) + angle;
    const double along = std::clamp(coil, 0., turns);
    return coil >= 0 && coil <= turns &&
           std::pow(off, 2) + std::pow(x[2] - half - along * pitch, 2) < half * half;
  });
}

// Clamps the lowest faces along `axis` and pushes the nodes at the other end, mostly across it.
inline VoxelProblem clamp_and_push(VoxelProblem problem, int axis) {
  int low = problem.geometry.index.front()[axis], high = low;
  for (const Index3& index : problem.geometry.index) {
    low = std::min(low, index[axis]);
    high = std::max(high, index[axis]);
  }
  clamp_low_faces(problem, axis, [=](const Voxel& v) { return v.at[axis] == low; });
  Vec3 force(.2, .3, .2);
  force[(axis + 2) % 3] = 1;
  push(problem, force, [=](const Index3& index) { return index[axis] == high; });
  return problem;
}

// The shapes of the benchmark tables, of about `cells` cells.
inline VoxelProblem beam(double cells) {  // 4 x 1 x 1
  const int n = std::max(1, static_cast<int>(std::lround(std::cbrt(cells / 4))));
  return clamp_and_push(assemble(carve({4 * n, n, n}), 1e-3), 0);
}
inline VoxelProblem plate(double cells, int thickness = 1) {
  const int n = static_cast<int>(std::lround(std::sqrt(cells / thickness)));
  return clamp_and_push(assemble(carve({n, n, thickness}), 1e-3), 0);
}
inline VoxelProblem i_beam(
    double cells) {  // 300 x 30 x 40, flanges and web 2 thick: walls of two cells or so at 50,000
  const double h = 300 / std::cbrt(cells / (300 * 30 * 40 * .16) * 300 * 300 * 300);
  const Index3 size = {static_cast<int>(300 / h), static_cast<int>(30 / h), static_cast<int>(40 / h)};
  const double wall = std::max(1., std::round(2 / h));
  return clamp_and_push(assemble(carve(size,
                                       [&](const Vec3& x) {
                                         return x[2] < wall || x[2] > size[2] - wall ||
                                                std::abs(x[1] - std::floor(.5 * size[1])) < .5 * wall;
                                       }),
                                 1e-3),
                        0);
}
inline VoxelProblem spring(double cells) {  // wire 4, radius 20, pitch 8, 6 turns
  const double turns = 6, volume = std::numbers::pi * 4 * 2 * std::numbers::pi * 20 * turns;
  const double scale = std::cbrt(cells / volume);
  return clamp_and_push(assemble(helical_spring(20 * scale, 4 * scale, 8 * scale, turns), 1e-3), 2);
}
inline VoxelProblem tube(
    double cells) {  // wall about .7 cells thick, turned against the lattice: steps one cell wide
  const double radius = std::sqrt(cells / (2 * std::numbers::pi * 10 * 1.2)), length = 10 * radius;
  const int width = static_cast<int>(2 * radius) + 4;
  const double tilt = .05;
  return clamp_and_push(
      assemble(carve({static_cast<int>(length), width + static_cast<int>(tilt * length), width},
                     [&](const Vec3& x) {
                       const double y = x[1] - .5 * width - tilt * x[0], z = x[2] - .5 * width;
                       return std::abs(std::hypot(y, z) - radius) < .65;
                     }),
               1e-3),
      0);
}

}  // namespace flexel::simulate::test
