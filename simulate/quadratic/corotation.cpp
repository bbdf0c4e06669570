// Cell by cell; sums over the nodes in the order of the cells, so that bits do not depend on the number of threads.
#include "simulate/quadratic/corotation.h"

#include <Eigen/LU>
#include <cmath>
#include <optional>

#include "base/parallel.h"
#include "simulate/quadratic/quadratic_solve.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kTurnedCellsAtATime = 16;
constexpr double kNothing = 1e-6;  // of the largest forces so far: smaller ones are what rounding leaves
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
      force_(system.nodes().cells.size() * kCellUnknowns) {}

bool Corotation::evaluate(std::size_t cell, const std::vector<Vec3>& displacement) {
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
  const CellValues force = product.col(0);
  const auto spins = columns.middleCols<3>(1);
  Mat3 turned = spins.transpose() * product.middleCols<3>(1), stressed = Mat3::Zero();
  Vec3 moment = Vec3::Zero();  // Y^T f
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    const Vec3 f = force.segment<3>(at(n));
    const Mat3 y = spins.middleRows<3>(at(n));
    moment -= y * f;
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

void Corotation::add_supports(std::size_t cell, const std::vector<Vec3>& displacement, double share) {
  if (system_.cell_supports(cell).empty()) return;
  const auto& of_cell = system_.nodes().of_cell[cell];
  const std::array<Vec3, kQuadraticNodes> local =
      local_displacement(system_.nodes(), cell, displacement, from_rest_[cell]);
  std::array<Vec3, kQuadraticNodes> u;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) u[n] = displacement[of_cell[n]];
  const Mat3& rotation = turn_[cell].rotation;
  std::array<Vec3, kQuadraticNodes> forces, led;
  forces.fill(Vec3::Zero());
  led.fill(Vec3::Zero());
  for (const SupportIntegrals& held : system_.cell_supports(cell)) {
    held.add_forces(system_.penalty(cell, safety_), u, local, rotation, forces);
    if (!held.support->tie->is_move) continue;
    for (const FacePoint* point : held.points)
      add_led(system_.point(*held.support, *point, safety_, share), rotation, led);
  }
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    Eigen::Map<Vec3> sum(&force_[cell * kCellUnknowns + 3 * n]);
    sum += forces[n] - led[n];
  }
}

bool Corotation::residual(const std::vector<Vec3>& displacement, double share, std::vector<Vec3>& left) {
  const QuadraticNodes& nodes = system_.nodes();
  std::vector<std::uint8_t> folded(nodes.cells.size(), 0);
  std::vector<double> square(nodes.cells.size(), 0);
  parallel_for_each(
      nodes.cells.size(),
      [&](std::size_t c) {
        folded[c] = !evaluate(c, displacement);
        square[c] = Eigen::Map<const CellValues>(&force_[c * kCellUnknowns]).squaredNorm();
        if (!folded[c]) add_supports(c, displacement, share);
      },
      kTurnedCellsAtATime);
  if (std::any_of(folded.begin(), folded.end(), [](std::uint8_t each) { return each != 0; })) return false;
  const double now = std::sqrt(parallel_sum<double>(square.size(), [&](std::size_t c) { return square[c]; }));
  largest_ = std::max(largest_, now);
  scale_ = std::max(now, kNothing * largest_);
  left.assign(nodes.size(), Vec3::Zero());
  for (const NodalLoad& load : system_.loads())
    for (std::size_t n = 0; n < nodes.size(); ++n) left[n] += share * load.forces[n];
  parallel_for_each(nodes.size(), [&](std::size_t n) {
    for (const QuadraticNodes::Incidence& incidence : nodes.at(n))
      left[n] -= Eigen::Map<const Vec3>(&force_[incidence.cell * kCellUnknowns + 3 * incidence.node]);
  });
  return true;
}

void Corotation::set_tangent(bool stressed) {
  std::vector<CellTurn> turns = turn_;
  if (stressed)
    for (std::size_t c = 0; c < turns.size(); ++c) turns[c].a += stress_[c];
  stiffness_.cells().turn(turns);
  parallel_for_each(
      turn_.size(),
      [&](std::size_t c) {
        if (!system_.cell_supports(c).empty())
          stiffness_.cells().set_support(c, system_.support_stiffness(c, safety_, turn_[c].rotation));
      },
      kTurnedCellsAtATime);
}

}  // namespace flexel::simulate
