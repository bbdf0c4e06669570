// Eigenvalues of one cell per part, and an upper bound on how a deformed cell's grow.
#include "simulate/models/stability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math/greatest.h"
#include "base/parallel.h"
#include "simulate/models/cells.h"
#include "simulate/models/corner_barrier.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

using CellMatrix = Eigen::Matrix<double, 24, 24>;

CellMatrix cells_stiffness(const CellKind& kind) {
  CellMatrix k;
  const CellTangent rest = cell_tangent(Mat3::Zero());
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < 8; ++b)
      k.block<3, 3>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b)) =
          tangent_block(kind, rest, a, b);
  return k;
}

CellMatrix springs_stiffness(const SpringKind& kind) {
  CellMatrix k = CellMatrix::Zero();
  const CellVectors rest = [] {
    CellVectors u;
    u.fill(Vec3::Zero());
    return u;
  }();
  for (const Spring& spring : kind.springs) {
    const Block block = spring_block(spring, rest, false);
    const auto a = 3 * static_cast<Eigen::Index>(spring.a), b = 3 * static_cast<Eigen::Index>(spring.b);
    k.block<3, 3>(a, a) += block;
    k.block<3, 3>(b, b) += block;
    k.block<3, 3>(a, b) -= block;
    k.block<3, 3>(b, a) -= block;
  }
  return k;
}

bool is_springs(const Problem& problem, std::size_t part) {
  return problem.models.size() > part && problem.models[part] == Model::springs;
}

// d2W/dF2 of the neo-Hookean energy has, with s the singular values of F, entries of at most mu + (mu +
// lambda (1 - ln J)) / s_min^2; at rest 2 mu + lambda.
// With plastic flow mu is that of b = F Cp^-1 F^T: at most 1 / s_min^2 where the flow follows F. With a rest
// shape mu is times the largest eigenvalue of Cp^-1, ln J less ln Jp, and all times Jp.
double cell_stiffening(const CellKind& kind, const CellVectors& u, bool plastic,
                       const std::optional<CellKind>& shaped) {
  const Mat3 gradient = displacement_gradient(kind, u);
  const double jacobian = 1 + volume_change(gradient);
  if (!(jacobian > 0)) return std::numeric_limits<double>::infinity();
  const Mat3 f = Mat3::Identity() + gradient;
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(f.transpose() * f, Eigen::EigenvaluesOnly);
  const double least = std::max(eigen.eigenvalues()[0], 1e-12);
  const double volume = shaped ? shaped->volume / kind.volume : 1;
  const double log_volume = std::log(jacobian / volume);
  const double coupling = kind.mu + kind.lambda * (1 - log_volume);
  double own = plastic ? kind.mu / std::min(least, 1.0) : kind.mu;
  if (shaped) {
    const Mat3 root = Mat3::Identity() + shaped->offset;
    eigen.computeDirect(root * root, Eigen::EigenvaluesOnly);
    own = std::max(own, kind.mu * eigen.eigenvalues()[2]);
  }
  return volume * (own + std::max(coupling, 0.0) / least) / (2 * kind.mu + kind.lambda);
}

// k (1 + extension) at most; compression turns the cross stiffness k (1 - l/d) negative, which slows.
double springs_stiffening(const SpringKind& kind, const CellVectors& u) {
  double largest = 1;
  for (const Spring& spring : kind.springs) {
    const double stretch =
        (spring.rest + u[spring.b] - u[spring.a]).norm() / (spring.rest.norm() + spring.flowed);
    largest = std::max(largest, 2 - 1 / stretch);
  }
  return largest;
}

}  // namespace

std::vector<double> cell_frequencies(const Problem& problem) {
  std::vector<double> result;
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p) {
    const Part& part = problem.body.parts[p];
    const bool rigid = problem.rigidity.size() > p && problem.rigidity[p] != Rigidity::none;
    if (part.cell_begin == part.cell_end || rigid) {
      result.push_back(0);
      continue;
    }
    const CellMatrix k = is_springs(problem, p)
                             ? springs_stiffness(spring_kind(part.lattice, problem.materials[p]))
                             : cells_stiffness(cell_kind(part.lattice, problem.materials[p]));
    const Eigen::SelfAdjointEigenSolver<CellMatrix> eigen(k, Eigen::EigenvaluesOnly);
    const double corner_mass = problem.materials[p].density * part.lattice.spacing.prod() / 8;
    result.push_back(eigen.eigenvalues()[23] / corner_mass);
  }
  return result;
}

double stable_step(double omega2, double tau) {
  if (!(omega2 < std::numeric_limits<double>::infinity())) return 0;  // a cell is folded
  if (!(omega2 > 0)) return std::numeric_limits<double>::infinity();
  const double omega = std::sqrt(omega2), zeta = tau * omega / 2;
  return 2 / omega / (std::sqrt(1 + zeta * zeta) + zeta);
}

double stable_step(const Problem& problem, const std::vector<double>& damping) {
  double step = std::numeric_limits<double>::infinity();
  const std::vector<double> omega2 = cell_frequencies(problem);
  for (std::size_t p = 0; p < omega2.size(); ++p) step = std::min(step, stable_step(omega2[p], damping[p]));
  return step;
}

std::vector<double> stiffening(const Problem& problem, const std::vector<Vec3>& displacement,
                               const KernelEffects& plan) {
  const Body& body = problem.body;
  const std::vector<std::uint8_t> active = active_cells(problem);
  const RestShapes shapes(body);
  std::vector<double> stiffness, mass;
  const bool edited =
      body.cell_columns.contains("stiffness_change") || body.cell_columns.contains("density_change");
  if (edited) {
    stiffness = stiffness_shares(body);
    mass = mass_shares(body);
  }
  std::vector<double> result;
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const CellKind cells = cell_kind(part.lattice, problem.materials[p]);
    const SpringKind springs = spring_kind(part.lattice, problem.materials[p]);
    const bool by_springs = is_springs(problem, p), plastic = !plan.plasticity.empty();
    const bool breaks = plan.broken_springs || (!plan.fracture.empty() && plan.fracture[p].any());
    const Greatest greatest = parallel_sum<Greatest>(part.cell_end - part.cell_begin, [&](std::size_t i) {
      const std::size_t c = part.cell_begin + i;
      if (!active[c]) return Greatest{};
      CellVectors u;
      for (std::size_t a = 0; a < 8; ++a) u[a] = displacement[body.cell_elements[c][a]];
      if (by_springs && !breaks && !(1 + volume_change(displacement_gradient(cells, u)) > 0))
        return Greatest{std::numeric_limits<double>::infinity()};
      const auto cell = static_cast<std::uint32_t>(c);
      const double factor = edited ? stiffness[c] / mass[c] : 1;
      if (by_springs)
        return Greatest{factor * springs_stiffening(
                                     shapes.any() ? shapes.of(springs, cell).value_or(springs) : springs, u)};
      if (!shapes.any()) {
        double stiffer = cell_stiffening(cells, u, plastic, std::nullopt);
        stiffer += fold_stiffening(cells, fold_thresholds(cells, std::nullopt), u);
        return Greatest{factor * stiffer};
      }
      const std::optional<CellKind> shaped = shapes.of(cells, part, cell);
      return Greatest{factor * (cell_stiffening(cells, u, plastic, shaped) +
                                fold_stiffening(cells, fold_thresholds(cells, shaped), u))};
    });
    result.push_back(std::max(1.0, greatest.value));
  }
  return result;
}

}  // namespace flexel::simulate
