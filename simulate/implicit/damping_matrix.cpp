// With F = I + H of a cell, J = det F and A = sym(F^T dF/dt), its dissipation tau V (K (dJ/dt)^2 + 2 mu |dev A|^2),
// K = lambda + 2 mu / 3, has the blocks
//     C_ab = tau V / 16 { K (c_a)(c_b)^T + mu (g_a . g_b) F F^T + mu (F g_b)(F g_a)^T - 2 mu / 3 (F g_a)(F g_b)^T },
// g the gradients gamma of simulate/models/cell_model.h, c = cof F g; of an orthotropic material the moduli C at
// rest, F C(g_a, g_b) F^T. The hourglass displacements q_m resist their rate
// as seen by an observer that is deformed with the cell, q' = dq/dt - dF/dt F^-1 q = sum_b v_mb v_b with the weights v_mb =
// s_mb / 8 - g_b . F^-1 q_m / 4: they add tau c_m v_ma v_mb I and, by K, tau F^-T axes [sum v_ma v_nb K_mn] axes^T F^-1.
// V is the volume of the cell's rest shape, all else as if that were the lattice's. A spring from a to b along the unit
// vector d adds tau k d d^T, a broken one nothing. Each row is gathered by one thread from its cells in ascending order.
#include "simulate/implicit/damping_matrix.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <optional>

#include "base/parallel.h"
#include "simulate/models/cells.h"
#include "simulate/models/damping_factors.h"
#include "simulate/models/prepared_cell.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

void add_hourglass(const CellKind& kind, const CellVectors& u, const Mat3& turned, std::size_t a,
                   std::array<Mat3, 8>& row) {
  HourglassTangent tangent = hourglass_tangent(kind, u, true);
  tangent.jacobian = 1;  // the dissipation is per volume at rest
  std::array<Block, 8> own;
  own.fill(Block::Zero());
  add_hourglass_row(kind, tangent, 1, a, 0, 8, own.data());
  for (std::size_t b = 0; b < 8; ++b) row[b] += own[b];
  const std::array<Vec3, 4> q = hourglass_displacements(kind, u);
  for (std::size_t mode = 0; mode < 4; ++mode) {
    const Vec3 arm = turned.transpose() * q[mode];
    const double scale = kind.hourglass[mode] * carried_mode(kind, arm, mode, a);
    for (std::size_t b = 0; b < 8; ++b) row[b].diagonal().array() += scale * carried_mode(kind, arm, mode, b);
  }
}

// Row a of one cell's C, over its tau and fill.
std::array<Mat3, 8> damping_row(const CellKind& kind, const CellVectors& u, std::size_t a) {
  const Mat3 f = Mat3::Identity() + displacement_gradient(kind, u);
  const Mat3 turned = f.inverse().transpose(), metric = f * f.transpose();
  const Mat3 cofactor = f.determinant() * turned;
  const Vec3 at = f * kind.gradient[a], swells = cofactor * kind.gradient[a];
  const double bulk = kind.lambda + 2 * kind.mu / 3;
  std::array<Mat3, 8> row;
  const bool orthotropic = kind.law.name == LawName::orthotropic;
  const Mat9 moduli = orthotropic ? elasticity(kind, Mat3(Mat3::Zero())) : Mat9(Mat9::Zero());
  for (std::size_t b = 0; b < 8; ++b) {
    if (orthotropic) {
      Mat3 own;
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          own(i, k) = kind.gradient[a].dot(moduli.block<3, 3>(3 * i, 3 * k) * kind.gradient[b]);
      row[b] = kind.volume / 16 * (f * own * f.transpose());
      continue;
    }
    const Vec3 other = f * kind.gradient[b];
    row[b] = kind.volume / 16 *
             (bulk * swells * (cofactor * kind.gradient[b]).transpose() +
              kind.mu * (kind.gradient[a].dot(kind.gradient[b]) * metric + other * at.transpose() -
                         2.0 / 3 * at * other.transpose()));
  }
  add_hourglass(kind, u, turned, a, row);
  return row;
}

std::array<Mat3, 8> damping_row(const SpringKind& kind, const CellVectors& u, std::size_t a) {
  std::array<Mat3, 8> row;
  row.fill(Mat3::Zero());
  for (const Spring& spring : kind.springs) {
    if (spring.a != a && spring.b != a) continue;
    const Vec3 along = (spring.rest + u[spring.b] - u[spring.a]).normalized();
    const Mat3 block = spring.stiffness * along * along.transpose();
    row[a] += block;
    row[spring.a == a ? spring.b : spring.a] -= block;
  }
  return row;
}

}  // namespace

void set_damping(const Problem& problem, const Stencil& stencil, const PaperModel& paper,
                 const std::vector<double>& damping, const std::vector<Vec3>& displacement,
                 BlockMatrix& matrix) {
  const Body& body = problem.body;
  const std::vector<std::uint32_t> part = element_parts(body);
  std::vector<double> share = stiffness_shares(body);
  for (const std::vector<double>& factor : {damping_factors(body), cell_factors(body, "rest_volume")})
    for (std::size_t c = 0; c < factor.size(); ++c) share[c] *= factor[c];
  const RestShapes rest(body);
  std::vector<CellKind> cells;
  std::vector<std::optional<SpringKind>> springs(body.parts.size());
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    cells.push_back(cell_kind(body.parts[p].lattice, problem.materials[p]));
    if (problem.models.size() > p && problem.models[p] == Model::springs)
      springs[p] = spring_kind(body.parts[p].lattice, problem.materials[p]);
  }
  parallel_for_each(body.element_count(), [&](std::size_t e) {
    Block* row = matrix.values.data() + matrix.row_offsets[e];
    std::fill(row, matrix.values.data() + matrix.row_offsets[e + 1], Block::Zero());
    const std::uint32_t p = part[e];
    if (!(damping[p] > 0)) return;
    for (const Incidence& at : stencil.of(static_cast<std::uint32_t>(e))) {
      CellVectors u;
      for (std::size_t a = 0; a < 8; ++a) u[a] = displacement[body.cell_elements[at.cell][a]];
      const std::array<Mat3, 8> blocks =
          springs[p] ? damping_row(rest.of(*springs[p], at.cell).value_or(*springs[p]), u, at.corner)
                     : damping_row(cells[p], u, at.corner);
      const double scale = damping[p] * share[at.cell];
      for (std::size_t b = 0; b < 8; ++b) row[stencil.slot[at.cell][8 * at.corner + b]] += scale * blocks[b];
    }
  });
  paper.add_damping_matrix({displacement}, damping, matrix);
}

}  // namespace flexel::simulate
