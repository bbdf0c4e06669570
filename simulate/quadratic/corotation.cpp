// Cell by cell; sums over the nodes in the order of the cells, so that bits do not depend on the number of threads.
#include "simulate/quadratic/corotation.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <optional>

#include "base/parallel.h"
#include "simulate/linear/vector_products.h"
#include "simulate/quadratic/quadratic_solve.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kTurnedCellsAtATime = 16;
constexpr double kRounded = 1e-8;  // the residual that is called so where rounding alone leaves one
using CellValues = Eigen::Matrix<double, kCellUnknowns, 1>;

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Index at(std::size_t node) {
  return static_cast<Eigen::Index>(3 * node);
}

// R - 1 of F = R U, from F - 1 and to its relative precision; nothing where F turns matter inside out.
// Newton's iteration R <- (R + R^-T) / 2 (Higham 1986), written for what is left beside 1.
std::optional<Mat3> polar_turn(const Mat3& gradient) {
  constexpr int kMost = 60;
  Mat3 turn = gradient;
  if (!((Mat3::Identity() + gradient).determinant() > 0)) return std::nullopt;
  for (int step = 0; step < kMost; ++step) {
    const Mat3 next = 0.5 * (turn - (Mat3::Identity() + turn.transpose()).inverse() * turn.transpose());
    const double change = (next - turn).norm();
    turn = next;
    if (change <= 1e-16 * turn.norm()) break;
  }
  return turn;
}

}  // namespace

Corotation::Corotation(const QuadraticSystem& system, QuadraticOperator& stiffness, double safety)
    : system_(system),
      stiffness_(stiffness),
      safety_(safety),
      from_rest_(system.nodes().cells.size(), Mat3::Zero()),
      turn_(system.nodes().cells.size()),
      stress_(system.nodes().cells.size()),
      force_(system.nodes().cells.size() * kCellUnknowns),
      local_force_(force_.size()) {
  for (std::uint32_t c = 0; c < system.nodes().cells.size(); ++c)
    if (system.is_supported(c)) supported_.push_back(c);
  for (std::size_t c = 0; c < system.nodes().cells.size(); ++c)
    stiffest_ = std::max(stiffest_, system.stiffest(c) * system.lattice(c).spacing.maxCoeff());
}

bool Corotation::evaluate(std::size_t cell, const std::vector<Vec3>& displacement, double share) {
  const QuadraticNodes& nodes = system_.nodes();
  const auto& of_cell = nodes.of_cell[cell];
  const QuadraticShape shape = world_shape(system_.lattice(cell), system_.middle(cell));
  Mat3 gradient = Mat3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    gradient += displacement[of_cell[n]] * shape.gradient[n].transpose();
  const std::optional<Mat3> found = polar_turn(gradient);
  if (!found) return false;
  from_rest_[cell] = *found;
  const Mat3 r = Mat3::Identity() + *found;
  CellTurn& turn = turn_[cell];
  turn.rotation = r;
  const Mat3 stretch = r.transpose() * (Mat3::Identity() + gradient);
  const Mat3 spin = (stretch.trace() * Mat3::Identity() - 0.5 * (stretch + stretch.transpose())).inverse();
  // u^ and Y side by side: one product with K
  CellColumns columns = CellColumns::Zero(), product;
  const std::array<Vec3, kQuadraticNodes> local =
      local_displacement(nodes, cell, displacement, from_rest_[cell]);
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    columns.block<3, 1>(at(n), 0) = local[n];
    columns.block<3, 3>(at(n), 1) = cross_matrix(nodes.rest[of_cell[n]] - nodes.rest[of_cell[0]] + local[n]);
    turn.gamma.middleRows<3>(at(n)) = -cross_matrix(shape.gradient[n]) * spin;
  }
  stiffness_.cells().elastic_forces(cell, columns, product);
  CellValues force = product.col(0);
  if (system_.heated()) force -= share * Eigen::Map<const CellValues>(system_.free_forces(cell).data());
  Eigen::Map<CellValues> kept(&local_force_[cell * kCellUnknowns]);
  const CellValues stress = foretold_ ? CellValues(kept) : force;
  kept = force;
  const auto spins = columns.middleCols<3>(1);
  Mat3 turned = spins.transpose() * product.middleCols<3>(1), stressed = Mat3::Zero();
  Vec3 moment = Vec3::Zero();  // Y^T f
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    const Vec3 f = stress.segment<3>(at(n));
    const Mat3 y = spins.middleRows<3>(at(n));
    moment -= y * force.segment<3>(at(n));
    stressed += cross_matrix(f) * y;
    stress_[cell].middleRows<3>(at(n)) = -cross_matrix(f);
  }
  stressed = (0.5 * (stressed + stressed.transpose())).eval();
  turn.a = product.middleCols<3>(1) + 0.5 * turn.gamma * turned;
  stress_[cell] += 0.5 * turn.gamma * stressed;
  const CellValues whole = force + turn.gamma * moment;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    Eigen::Map<Vec3> turned_force(&force_[cell * kCellUnknowns + 3 * n]);
    turned_force = r * whole.segment<3>(at(n));
  }
  return true;
}

std::array<Vec3, kQuadraticNodes> Corotation::support_forces(std::size_t cell,
                                                             const std::vector<Vec3>& displacement,
                                                             double share) const {
  const auto& of_cell = system_.nodes().of_cell[cell];
  const std::array<Vec3, kQuadraticNodes> local =
      local_displacement(system_.nodes(), cell, displacement, from_rest_[cell]);
  std::array<Vec3, kQuadraticNodes> u;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) u[n] = displacement[of_cell[n]];
  const Mat3& rotation = turn_[cell].rotation;
  std::array<Vec3, kQuadraticNodes> taken, led;
  taken.fill(Vec3::Zero());
  led.fill(Vec3::Zero());
  for (const SupportIntegrals& held : system_.cell_supports(cell)) {
    held.add_forces(system_.penalty(cell, safety_), share, u, local, rotation, taken);
    if (!held.support->tie->is_move) continue;
    for (const FacePoint* point : held.points)
      add_led(system_.point(*held.support, *point, safety_, share), rotation, led);
  }
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) led[n] -= taken[n];
  return led;
}

void Corotation::take_bonds(const std::vector<Vec3>& displacement, std::vector<Vec3>& left) const {
  const QuadraticNodes& nodes = system_.nodes();
  std::vector<std::array<NodeVectors, 2>> forces(system_.bonds().size());
  parallel_for_each(
      forces.size(),
      [&](std::size_t p) {
        const auto& cell = system_.bonds()[p].cell;
        std::array<NodeVectors, 2> u, local;
        for (std::size_t side = 0; side < 2; ++side) {
          local[side] = local_displacement(nodes, cell[side], displacement, from_rest_[cell[side]]);
          for (std::size_t n = 0; n < kQuadraticNodes; ++n)
            u[side][n] = displacement[nodes.of_cell[cell[side]][n]];
        }
        forces[p] = bond_forces(system_.bond(p, safety_), u, local,
                                {turn_[cell[0]].rotation, turn_[cell[1]].rotation});
      },
      kTurnedCellsAtATime);
  for (std::size_t p = 0; p < forces.size(); ++p)
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        left[nodes.of_cell[system_.bonds()[p].cell[side]][n]] -= forces[p][side][n];
}

bool Corotation::residual(const std::vector<Vec3>& displacement, double share, std::vector<Vec3>& left) {
  const QuadraticNodes& nodes = system_.nodes();
  std::vector<std::uint8_t> folded(nodes.cells.size(), 0);
  parallel_for_each(
      nodes.cells.size(), [&](std::size_t c) { folded[c] = !evaluate(c, displacement, share); },
      kTurnedCellsAtATime);
  foretold_ = false;
  if (std::any_of(folded.begin(), folded.end(), [](std::uint8_t each) { return each != 0; })) return false;
  std::vector<std::array<Vec3, kQuadraticNodes>> held(supported_.size());
  parallel_for_each(
      supported_.size(), [&](std::size_t i) { held[i] = support_forces(supported_[i], displacement, share); },
      kTurnedCellsAtATime);
  left.assign(nodes.size(), Vec3::Zero());
  for (const NodalLoad& load : system_.loads()) load.add_to(displacement, share, left);
  for (std::size_t i = 0; i < supported_.size(); ++i)
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) left[nodes.of_cell[supported_[i]][n]] += held[i][n];
  double outer = dot(left, left);
  outer += std::pow(share * system_.free_force(), 2);
  take_bonds(displacement, left);
  parallel_for_each(nodes.size(), [&](std::size_t n) {
    for (const QuadraticNodes::Incidence& incidence : nodes.at(n))
      left[n] -= Eigen::Map<const Vec3>(&force_[incidence.cell * kCellUnknowns + 3 * incidence.node]);
  });
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (int axis = 0; axis < 3; ++axis)
      if (stiffness_.held()[n] >> axis & 1) outer += left[n][axis] * left[n][axis];
  double reach = 0;
  for (const Vec3& each : displacement) reach = std::max(reach, each.squaredNorm());
  const double rounding = 2 * std::numeric_limits<double>::epsilon() *
                          std::sqrt(3 * static_cast<double>(nodes.size()) * reach) * stiffest_;
  scale_ = std::max(std::sqrt(outer), rounding / kRounded);
  return true;
}

void Corotation::foretell(const std::vector<Vec3>& displacement, const std::vector<Vec3>& change,
                          double more) {
  const QuadraticNodes& nodes = system_.nodes();
  parallel_for_each(
      nodes.cells.size(),
      [&](std::size_t c) {
        const auto& of_cell = nodes.of_cell[c];
        const std::array<Vec3, kQuadraticNodes> local =
            local_displacement(nodes, c, displacement, from_rest_[c]);
        CellColumns columns = CellColumns::Zero(), product;
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          columns.block<3, 1>(at(n), 0) =
              turn_[c].rotation.transpose() * (change[of_cell[n]] - change[of_cell[0]]);
        const Vec3 spin = turn_[c].gamma.transpose() * columns.col(0);
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          columns.block<3, 1>(at(n), 0) +=
              (nodes.rest[of_cell[n]] - nodes.rest[of_cell[0]] + local[n]).cross(spin);
        stiffness_.cells().elastic_forces(c, columns, product);
        Eigen::Map<CellValues> force(&local_force_[c * kCellUnknowns]);
        force += product.col(0);
        if (system_.heated()) force -= more * Eigen::Map<const CellValues>(system_.free_forces(c).data());
      },
      kTurnedCellsAtATime);
  foretold_ = true;
}

void Corotation::stress_forces(const double* x, double* y) const {
  const QuadraticNodes& nodes = system_.nodes();
  std::vector<double> force(nodes.cells.size() * kCellUnknowns);
  parallel_for_each(
      nodes.cells.size(),
      [&](std::size_t c) {
        const CellTurn& turn = turn_[c];
        CellValues local;
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          local.segment<3>(at(n)) =
              turn.rotation.transpose() * Eigen::Map<const Vec3>(x + 3 * std::size_t{nodes.of_cell[c][n]});
        const Vec3 spin = turn.gamma.transpose() * local, pull = stress_[c].transpose() * local;
        const CellValues sum = stress_[c] * spin + turn.gamma * pull;
        for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
          Eigen::Map<Vec3> to(&force[c * kCellUnknowns + 3 * n]);
          to = turn.rotation * sum.segment<3>(at(n));
        }
      },
      kTurnedCellsAtATime);
  parallel_for_each(nodes.size(), [&](std::size_t n) {
    Vec3 sum = Vec3::Zero();
    for (const QuadraticNodes::Incidence& incidence : nodes.at(n))
      sum += Eigen::Map<const Vec3>(&force[incidence.cell * kCellUnknowns + 3 * incidence.node]);
    Eigen::Map<Vec3> to(y + 3 * n);
    to = sum;
  });
}

void Corotation::set_tangent(bool stressed) {
  if (stressed)
    stiffness_.cells().turn(turn_, stress_);
  else
    stiffness_.cells().turn(turn_);
  parallel_for_each(
      supported_.size(),
      [&](std::size_t i) {
        const std::uint32_t c = supported_[i];
        stiffness_.cells().set_support(c, system_.support_stiffness(c, safety_, turn_[c].rotation));
      },
      kTurnedCellsAtATime);
  if (stiffness_.cells().couplings() == nullptr) return;
  stiffness_.cells().set_couplings(nullptr);  // before there are others
  stiffness_.cells().set_couplings(
      system_.couplings(safety_, [&](std::size_t c) { return turn_[c].rotation; }));
}

}  // namespace flexel::simulate
