// Eigenvalues of one cell per part, and an upper bound on how a deformed cell's grow.
#include "simulate/models/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"
#include "base/math/greatest.h"
#include "base/parallel.h"
#include "simulate/models/cells.h"
#include "simulate/models/corner_barrier.h"
#include "simulate/models/prepared_cell.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

using CornersMatrix = Eigen::Matrix<double, 24, 24>;

CornersMatrix cells_stiffness(const CellKind& kind) {
  CornersMatrix k;
  const std::array<Block, 64> blocks = blocks_at_rest(kind);
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < 8; ++b)
      k.block<3, 3>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b)) = blocks[8 * a + b];
  return k;
}

CornersMatrix springs_stiffness(const SpringKind& kind) {
  CornersMatrix k = CornersMatrix::Zero();
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

// Of the hourglass modes of a deformed cell: c_m, K / s_min^2, s_min the least stretch, J, and over the least spacing h
// sqrt(sum_m |F^-1 q_m|^2), or that of F^-1 e_m if it is more, and sqrt(sum_m |Q_m|^2) of a rest shape.
struct HourglassGrowth {
  double free = 0, by_mode = 0;  // N/m
  double jacobian = 1, drawn = 0, flowed = 0;
};

HourglassGrowth hourglass_growth(const CellKind& kind, const Vec3& spacing, const CellVectors& u,
                                 const Mat3& gradient, const std::optional<CellKind>& shaped = {}) {
  const Mat3 f = Mat3::Identity() + gradient;
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(f.transpose() * f, Eigen::EigenvaluesOnly);
  const Mat3 inverse = f.inverse();
  HourglassGrowth growth;
  const auto size = [&](const std::array<Vec3, 4>& of) {
    double square = 0;
    for (const Vec3& each : of) square += each.squaredNorm();
    return std::sqrt(square) / spacing.minCoeff();
  };
  const auto drawn_back = [&](std::array<Vec3, 4> q) {
    for (Vec3& each : q) each = (inverse * each).eval();
    return size(q);
  };
  const CellKind& of = shaped ? *shaped : kind;
  growth.free = *std::max_element(of.hourglass.begin(), of.hourglass.end());
  growth.by_mode = kind.by_mode_largest / std::max(eigen.eigenvalues()[0], 1e-12);
  growth.jacobian = 1 + volume_change(gradient);
  growth.drawn = drawn_back(hourglass_displacements(kind, u));
  if (!shaped) return growth;
  growth.drawn = std::max(growth.drawn, drawn_back(hourglass_displacements(*shaped, u)));
  growth.flowed = size(shaped->mode_offset);
  return growth;
}

// Of the energy over the largest eigenvalue at rest `largest` [N/m], at most: alone, and what the coupling of q_m with F adds.
// With k = J K / s_min^2 the second derivative of J/2 p K p is at most k times
//     (|dq| + |dF| |p|)^2 + 2 (1 + sqrt 3) |p| |dF| (|dq| + |dF| |p|) + 2 |p|^2 |dF|^2,
// and of displacements of size 1 |dq|^2 is at most 1/8, |dF|^2 1 / (2 h^2), |dq| |dF| 1 / (8 h). That of c_m |q_m - F Q_m|^2 / 2
// is c_m (|dq| + |dF| |Q|)^2 at most.
double alone(const HourglassGrowth& growth, double largest) {
  return (growth.free + growth.jacobian * growth.by_mode) / 8 / largest;
}
double coupling(const HourglassGrowth& growth, double largest) {
  return (growth.jacobian * growth.by_mode * growth.drawn * (1 + 4.3 * growth.drawn) +
          growth.free * growth.flowed * (0.25 + 0.5 * growth.flowed)) /
         largest;
}

// With plastic flow, of neo-Hooke alone, its stretch counts too (simulate/laws/neo_hooke_scalar.h). Other laws
// bound by the largest modulus, exact for cubes: a cell's largest eigenvalue is that modulus times the gradients'
// squares, which spacings differ in.
double mean_stiffening(const CellKind& kind, const Vec3& spacing, const Mat3& gradient, bool plastic,
                       const std::optional<CellKind>& shaped) {
  if (kind.law.name != LawName::neo_hooke) {
    const double ratio = spacing.maxCoeff() / spacing.minCoeff();
    return ratio * ratio * stiffening(kind.law, gradient);
  }
  neo_hooke::Flow flow{plastic};
  if (shaped) {
    const Mat3 root = Mat3::Identity() + shaped->offset;
    Eigen::SelfAdjointEigenSolver<Mat3> eigen;
    eigen.computeDirect(root * root, Eigen::EigenvaluesOnly);
    flow.metric = eigen.eigenvalues()[2];
    flow.volume = shaped->volume / kind.volume;
  }
  return neo_hooke::stiffening(kind.law, gradient, flow);
}

double cell_stiffening(const CellKind& kind, const Vec3& spacing, const CellVectors& u, bool plastic,
                       const std::optional<CellKind>& shaped, double largest) {
  const Mat3 gradient = displacement_gradient(kind, u);
  const HourglassGrowth hourglass = hourglass_growth(kind, spacing, u, gradient, shaped);
  return std::max(mean_stiffening(kind, spacing, gradient, plastic, shaped), alone(hourglass, largest)) +
         coupling(hourglass, largest);
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

struct Polar {
  Mat3 rotation;
  double longest = 0, shortest = 0;  // stretches
};

Polar polar(const Mat3& f) {
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(f.transpose() * f);
  const Vec3 stretch = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
  return {f * eigen.eigenvectors() * stretch.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose(),
          stretch[2], stretch[0]};
}

// By how much at most |dF/dt| counts more than at rest, in the square root of K (dJ/dt)^2 + 2 mu |dev A|^2: that of
// orthotropic moduli is at most the longest stretch. With that at rest of A alone and of the rest, K ((cof F - F) : dF/dt)^2;
// or with the sum of both.
double rate_growth(const CellKind& kind, const Mat3& f, const Polar& of) {
  const double longest = std::max(1.0, of.longest);
  if (kind.law.name == LawName::orthotropic) return longest;
  Mat3 cofactor;
  for (int i = 0; i < 3; ++i) cofactor.col(i) = f.col((i + 1) % 3).cross(f.col((i + 2) % 3));
  const double bulk = 3 * kind.lambda + 2 * kind.mu, shear = 2 * kind.mu;
  const double apart = longest + (cofactor - f).norm() / std::sqrt(3.0);
  const double sum = bulk * cofactor.squaredNorm() / 3 + shear * of.longest * of.longest;
  return std::max(1.0, std::min(apart, std::sqrt(sum / std::max(bulk, shear))));
}

// Over the largest eigenvalue at rest, `largest` [N/m]. The square root of a sum of dissipations is at most the sum
// of theirs: that at rest, grown by the stretch, and that by what dF/dt does to hourglass displacements. |dF/dt|^2 is at
// most 1 / (2 h^2) of the velocities' squares; unequal spacings bound as in cell_stiffening().
double damping_growth(const CellKind& kind, const Vec3& spacing, const CellVectors& u, double largest) {
  const Mat3 f = Mat3::Identity() + displacement_gradient(kind, u);
  if (f == Mat3::Identity()) return 1;
  const HourglassGrowth hourglass = hourglass_growth(kind, spacing, u, f - Mat3::Identity());
  const double stiffness = hourglass.free + hourglass.by_mode;
  const double turned = stiffness * hourglass.drawn * hourglass.drawn / 2;  // N/m
  const double ratio = spacing.maxCoeff() / spacing.minCoeff();
  const double still = std::max(ratio * rate_growth(kind, f, polar(f)), std::sqrt(stiffness / 8 / largest));
  return std::pow(still + std::sqrt(turned / largest), 2);
}

// Likewise: springs turn against the cell. At most Gershgorin's bound, each row's sum.
double damping_growth(const SpringKind& kind, const CellKind& cell, const CellVectors& u, double largest) {
  const Mat3 rotation = polar(Mat3::Identity() + displacement_gradient(cell, u)).rotation;
  std::array<double, 8> at_corner{};
  double turned = 0;
  for (const Spring& spring : kind.springs) {
    const Vec3 now = (spring.rest + u[spring.b] - u[spring.a]).normalized();
    turned = std::max(turned, (rotation.transpose() * now - spring.rest.normalized()).norm());
    at_corner[spring.a] += 2 * spring.stiffness;
    at_corner[spring.b] += 2 * spring.stiffness;
  }
  const double most = *std::max_element(at_corner.begin(), at_corner.end()) / largest;
  const double growth = std::pow(1 + turned * std::sqrt(most), 2);
  return growth < most ? growth : most;  // also where the cell has no rotation
}

// (parts) The greatest factor of any active cell, 1 at least. `factor_of(p)` is a function of a cell of part p
// and its corners' displacements (m); edits of the cell's stiffness and density multiply what it gives.
template <class FactorOf>
std::vector<double> greatest_factors(const Problem& problem, const std::vector<Vec3>& displacement,
                                     const FactorOf& factor_of) {
  const Body& body = problem.body;
  const std::vector<std::uint8_t> active = active_cells(problem);
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
    const auto factor = factor_of(p);
    const Greatest greatest = parallel_sum<Greatest>(part.cell_end - part.cell_begin, [&](std::size_t i) {
      const std::size_t c = part.cell_begin + i;
      if (!active[c]) return Greatest{};
      CellVectors u;
      for (std::size_t a = 0; a < 8; ++a) u[a] = displacement[body.cell_elements[c][a]];
      return Greatest{(edited ? stiffness[c] / mass[c] : 1) * factor(static_cast<std::uint32_t>(c), u)};
    });
    result.push_back(std::max(1.0, greatest.value));
  }
  return result;
}

}  // namespace

std::vector<CellOfPart> cells_of_parts(const Problem& problem) {
  std::vector<CellOfPart> result;
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p) {
    const Part& part = problem.body.parts[p];
    const Material& material = problem.materials[p];
    result.push_back({cell_kind(part.lattice, material), spring_kind(part.lattice, material)});
    CellOfPart& made = result.back();
    const bool rigid = problem.rigidity.size() > p && problem.rigidity[p] != Rigidity::none;
    if (part.cell_begin == part.cell_end || rigid) continue;
    made.largest = eigenvalues_symmetric(is_springs(problem, p) ? springs_stiffness(made.springs)
                                                                : cells_stiffness(made.cells))[23];
    made.frequency = made.largest / (material.density * part.lattice.spacing.prod() / 8);
  }
  return result;
}

std::vector<double> damping_growth(const Problem& problem, const std::vector<CellOfPart>& cells,
                                   const std::vector<Vec3>& displacement) {
  return greatest_factors(problem, displacement, [&](std::size_t p) {
    const Lattice& lattice = problem.body.parts[p].lattice;
    return
        [&lattice, &of = cells[p], by_springs = is_springs(problem, p)](std::uint32_t, const CellVectors& u) {
          return by_springs ? damping_growth(of.springs, of.cells, u, of.largest)
                            : damping_growth(of.cells, lattice.spacing, u, of.largest);
        };
  });
}

std::vector<double> cell_frequencies(const Problem& problem) {
  std::vector<double> result;
  for (const CellOfPart& each : cells_of_parts(problem)) result.push_back(each.frequency);
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

std::vector<double> stiffening(const Problem& problem, const std::vector<CellOfPart>& cells,
                               const std::vector<Vec3>& displacement, const KernelEffects& plan) {
  const RestShapes shapes(problem.body);
  const bool plastic = !plan.plasticity.empty();
  return greatest_factors(problem, displacement, [&](std::size_t p) {
    const Part& part = problem.body.parts[p];
    const bool by_springs = is_springs(problem, p);
    const bool breaks = plan.broken_springs || (!plan.fracture.empty() && plan.fracture[p].any());
    return
        [&part, &shapes, &of = cells[p], plastic, by_springs, breaks](std::uint32_t c, const CellVectors& u) {
          if (by_springs && !breaks && !(1 + volume_change(displacement_gradient(of.cells, u)) > 0))
            return std::numeric_limits<double>::infinity();
          if (by_springs)
            return springs_stiffening(
                shapes.any() ? shapes.of(of.springs, c).value_or(of.springs) : of.springs, u);
          const std::optional<CellKind> shaped = shapes.any() ? shapes.of(of.cells, part, c) : std::nullopt;
          return cell_stiffening(of.cells, part.lattice.spacing, u, plastic, shaped, of.largest) +
                 fold_stiffening(of.cells, fold_thresholds(of.cells, shaped), u);
        };
  });
}

}  // namespace flexel::simulate
