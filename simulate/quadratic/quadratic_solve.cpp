// Conjugate gradients on the change from what supports prescribe; then figures of the field, cell by cell.
#include "simulate/quadratic/quadratic_solve.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/free_motions.h"

namespace flexel::simulate {
namespace {

constexpr double kMoreSafety = 4;
constexpr int kSafeties = 4;
constexpr int kMostIterations = 1000;
constexpr double kLeastTolerance = 1e-10;
constexpr double kGoodEnough = 1e-6;  // of the loads, where rounding allows no less
constexpr double kBesideCell = 1e-3;  // of a cell: a point so far outside still counts as in it
constexpr std::size_t kCellsAtATime = 64;

std::array<Vec3, kQuadraticNodes> values_at(const QuadraticSystem& system, const QuadraticSolution& solution,
                                            std::size_t cell) {
  std::array<Vec3, kQuadraticNodes> u;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    u[n] = solution.displacement[system.nodes().of_cell[cell][n]];
  return u;
}

std::string axis_name(const Vec3& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(direction[axis]) > 0.999) return std::string(1, static_cast<char>('x' + axis));
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
}

void refuse_free(const QuadraticMultigrid& multigrid, const Body& body, const std::string& scene) {
  const std::vector<FreeMotion> free = free_motions(multigrid.coarse(), multigrid.geometry());
  if (free.empty()) return;
  const FreeMotion& motion = free.front();
  throw InputError(
      scene,
      fmt::format("part \"{}\" is free to {}: add a [[fix]] that stops it", body.parts[motion.part].name,
                  motion.rotation == Vec3::Zero() ? "translate along " + axis_name(motion.translation)
                                                  : "rotate about " + axis_name(motion.rotation)));
}

SymmetricStress stress_at(const Mat9& moduli, const Mat3& gradient) {
  Eigen::Matrix<double, 9, 1> h;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) h[3 * k + l] = gradient(k, l);
  const Eigen::Matrix<double, 9, 1> s = moduli * h;
  SymmetricStress stress;
  stress << s[0], s[4], s[8], 0.5 * (s[1] + s[3]), 0.5 * (s[5] + s[7]), 0.5 * (s[6] + s[2]);
  return stress;
}

// The middle of a cell's matter; of the voxel where there is none to speak of.
Vec3 middle_of(const QuadraticSystem& system, std::size_t cell) {
  return CellIntegrals::middle(system.moments(cell)).cwiseMax(0).cwiseMin(1);
}

}  // namespace

QuadraticSolution solve(const QuadraticSystem& system, const RunSettings& settings, const std::string& scene,
                        const std::function<void(int, double)>& progress) {
  QuadraticSolution found;
  const std::size_t n = system.nodes().size();
  for (int attempt = 0; attempt < kSafeties; ++attempt, found.safety *= kMoreSafety) {
    const QuadraticOperator stiffness = system.stiffness(found.safety);
    const QuadraticMultigrid multigrid(stiffness, system.problem().body);
    if (attempt == 0) refuse_free(multigrid, system.problem().body, scene);
    const std::vector<Vec3> wanted = system.right_side(found.safety);
    std::vector<Vec3> b = wanted, led(n), start = system.prescribed(), change;
    stiffness.forces(start[0].data(), led[0].data());
    parallel_for_each(n, [&](std::size_t i) { b[i] -= led[i]; });
    stiffness.clear_held(b);
    const LinearResult result =
        conjugate_gradients(stiffness, b, change, multigrid, std::max(settings.tolerance, kLeastTolerance),
                            kMostIterations, progress);
    found.iterations += result.iterations;
    found.relative_residual = result.relative_residual;
    if (result.iterations == kMostIterations) break;
    if (result.indefinite || !(result.converged || result.relative_residual < kGoodEnough)) continue;
    found.displacement = start;
    parallel_for_each(n, [&](std::size_t i) { found.displacement[i] += change[i]; });
    found.unbalanced.resize(n);
    stiffness.forces(found.displacement[0].data(), found.unbalanced[0].data());
    parallel_for_each(n, [&](std::size_t i) { found.unbalanced[i] = wanted[i] - found.unbalanced[i]; });
    return found;
  }
  throw DivergedError(
      fmt::format("model \"quadratic\" did not converge: residual {:.2g} after {} iterations; use "
                  "another --size, or model \"cells\"",
                  found.relative_residual, found.iterations));
}

Mat3 gradient_at(const QuadraticSystem& system, const QuadraticSolution& solution, std::size_t cell,
                 const Vec3& at) {
  const QuadraticShape shape = world_shape(system.problem().body.parts[system.part_of(cell)].lattice, at);
  const auto u = values_at(system, solution, cell);
  Mat3 sum = Mat3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) sum += u[n] * shape.gradient[n].transpose();
  return sum;
}

void write_field(const QuadraticSystem& system, const QuadraticSolution& solution, Body& body, State& state) {
  const QuadraticNodes& nodes = system.nodes();
  state.displacement.assign(body.element_count(), Vec3::Zero());
  for (std::size_t i = 0; i < nodes.elements.size(); ++i)
    state.displacement[nodes.elements[i]] = solution.displacement[i];
  constexpr int kBetween = 57;
  Column column{kBetween, std::vector<double>(kBetween * body.cell_count(), 0)};
  for (std::size_t c = 0; c < nodes.cells.size(); ++c) {
    double* to = &column.values[static_cast<std::size_t>(kBetween) * nodes.cells[c]];
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      if (corner_of_node(n) < 8) continue;
      const Vec3& u = solution.displacement[nodes.of_cell[c][n]];
      to = std::copy(u.begin(), u.end(), to);
    }
  }
  body.cell_columns[kQuadraticColumn] = std::move(column);
}

void carry_field(const QuadraticNodes& nodes, const State& state, Body& body) {
  constexpr std::size_t kBetween = 57;
  std::vector<double>& values = body.cell_columns.at(kQuadraticColumn).values;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (std::binary_search(nodes.cells.begin(), nodes.cells.end(), c)) continue;
    double* to = &values[kBetween * c];
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      if (corner_of_node(n) < 8) continue;
      const std::array<std::size_t, 3> at{n % 3, n / 3 % 3, n / 9};
      Vec3 sum = Vec3::Zero();
      for (std::size_t a = 0; a < 8; ++a) {
        double weight = 1;
        for (std::size_t axis = 0; axis < 3; ++axis)
          weight *= at[axis] == 1 ? 0.5 : at[axis] / 2 == (a >> axis & 1) ? 1 : 0;
        sum += weight * state.displacement[body.cell_elements[c][a]];
      }
      to = std::copy(sum.begin(), sum.end(), to);
    }
  }
}

Stresses field_stresses(const QuadraticSystem& system, const QuadraticSolution& solution,
                        const State& state) {
  const Body& body = system.problem().body;
  const QuadraticNodes& nodes = system.nodes();
  Stresses found = stresses(system.problem(), state);  // for the points that elements stand for
  parallel_for_each(
      nodes.cells.size(),
      [&](std::size_t c) {
        found.cell[nodes.cells[c]] = stress_at(system.moduli(system.part_of(c)),
                                               gradient_at(system, solution, c, middle_of(system, c)));
      },
      kCellsAtATime);
  parallel_for_each(
      nodes.elements.size(),
      [&](std::size_t i) {
        const std::uint32_t e = nodes.elements[i];
        // the cells that hold the point; where none does, the one that it is the least outside of
        double least = 1e300;
        int count = 0;
        SymmetricStress sum = SymmetricStress::Zero();
        for (const QuadraticNodes::Incidence& around : nodes.at(i)) {
          const Part& part = body.parts[system.part_of(around.cell)];
          const Vec3 at = cell_coordinates(body, part, nodes.cells[around.cell], found.element_at[e]);
          const double outside = std::max({0.0, -at.minCoeff(), at.maxCoeff() - 1}) <= kBesideCell
                                     ? 0
                                     : std::max(-at.minCoeff(), at.maxCoeff() - 1);
          if (outside > least) continue;
          if (outside < least) {
            least = outside;
            count = 0;
            sum.setZero();
          }
          sum += stress_at(system.moduli(system.part_of(around.cell)),
                           gradient_at(system, solution, around.cell, at));
          ++count;
        }
        if (count > 0) found.element[e] = sum / count;
      },
      kCellsAtATime);
  return found;
}

void report(const QuadraticSystem& system, const QuadraticSolution& solution, SimulateResult& result) {
  const QuadraticNodes& nodes = system.nodes();
  std::vector<std::uint8_t> counted(nodes.size(), 0);  // a node of two supports counts for the first
  for (const NitscheSupport& support : system.supports()) {
    Reaction reaction{support.tie->name, Vec3::Zero(), Vec3::Zero()};
    for (const FacePoint& at : support.points)
      add_at(flexel::simulate::reaction(system.point(support, at, solution.safety),
                                        values_at(system, solution, at.cell)),
             at.position, reaction.force, reaction.moment);
    for (const std::uint32_t n : support.nodes) {
      Vec3 held = Vec3::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (support.tie->axes[axis] && !(counted[n] >> axis & 1)) {
          counted[n] = static_cast<std::uint8_t>(counted[n] | 1u << axis);
          held[static_cast<Eigen::Index>(axis)] = -solution.unbalanced[n][static_cast<Eigen::Index>(axis)];
        }
      add_at(held, nodes.rest[n], reaction.force, reaction.moment);
    }
    result.reactions.push_back(reaction);
  }
  for (const NodalLoad& load : system.loads()) {
    AppliedLoad total{load.name, Vec3::Zero(), Vec3::Zero()};
    for (std::size_t n = 0; n < nodes.size(); ++n)
      add_at(load.forces[n], nodes.rest[n], total.force, total.moment);
    result.loads.push_back(total);
  }
  result.elastic_energy = parallel_sum<double>(
      nodes.cells.size(),
      [&](std::size_t c) {
        Eigen::Matrix<double, kCellUnknowns, 1> u;
        const auto values = values_at(system, solution, c);
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          u.segment<3>(static_cast<Eigen::Index>(3 * n)) =
              values[n] - values[0];  // a translation costs nothing
        return 0.5 * u.dot(system.elastic_stiffness(c) * u);
      },
      kCellsAtATime);
  for (std::size_t c = 0; c < nodes.cells.size(); ++c)
    result.smallest_jacobian =
        std::min(result.smallest_jacobian,
                 (Mat3::Identity() + gradient_at(system, solution, c, middle_of(system, c))).determinant());
}

double largest_rotation(const QuadraticSystem& system, const QuadraticSolution& solution) {
  double largest = 0;
  for (std::size_t c = 0; c < system.nodes().cells.size(); ++c) {
    const Mat3 h = gradient_at(system, solution, c, middle_of(system, c));
    largest = std::max(largest, 0.5 * Vec3(h(2, 1) - h(1, 2), h(0, 2) - h(2, 0), h(1, 0) - h(0, 1)).norm());
  }
  return largest;
}

}  // namespace flexel::simulate
