// Conjugate gradients on the change from what supports prescribe; then figures of the field, cell by cell.
#include "simulate/quadratic/quadratic_solve.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "simulate/input/scene_words.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/free_motions.h"
#include "simulate/linear/vector_products.h"
#include "simulate/matter/load_distribution.h"
#include "simulate/quadratic/quadratic_links.h"

namespace flexel::simulate {
namespace {

constexpr int kSafeties = 4;
constexpr int kMostLinearIterations = 1000;
constexpr int kMostWidenings = 3;  // of the preconditioner's range, where it shows as not positive
constexpr double kLeastLinearTolerance = 1e-10;
constexpr double kLinearGoodEnough = 1e-6;  // of the loads, where rounding allows no less
constexpr std::size_t kAnswerCellsAtATime = 64;

std::array<Vec3, kQuadraticNodes> values_at(const QuadraticSystem& system, const QuadraticSolution& solution,
                                            std::size_t cell) {
  std::array<Vec3, kQuadraticNodes> u;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    u[n] = solution.displacement[system.nodes().of_cell[cell][n]];
  return u;
}

void refuse_free(const QuadraticMultigrid& multigrid, const Body& body, const std::string& scene) {
  const std::vector<FreeMotion> free = free_motions(multigrid.coarse(), multigrid.geometry());
  if (free.empty()) return;
  throw InputError(scene, fmt::format("part \"{}\" is free to {}: add {} that stops it",
                                      body.parts[free.front().part].name, motion_name(free.front()),
                                      words_of(scene).a_fix));
}

// From what free strain makes of the parts, where that is nearer to equilibrium.
void start_nearer(const QuadraticSystem& system, QuadraticSolution& solution) {
  const std::vector<Vec3> wanted = system.right_side(solution.safety);
  const auto left = [&](const std::vector<Vec3>& displacement) {
    std::vector<Vec3> forces(wanted.size());
    solution.tangent->stiffness.forces(displacement[0].data(), forces[0].data());
    for (std::size_t n = 0; n < forces.size(); ++n) forces[n] = wanted[n] - forces[n];
    solution.tangent->stiffness.clear_held(forces);
    return dot(forces, forces);
  };
  std::vector<Vec3> free = system.free_shape();
  if (left(free) < left(solution.displacement)) solution.displacement = std::move(free);
}

// N, what a residual is small beside: what loads and moves ask for while links are at rest.
double scale_of(const QuadraticSystem& system, const QuadraticSolution& solution) {
  const LinkBalance links(system);
  const Eigen::VectorXd q = links.motions();
  links.set_motions(Eigen::VectorXd::Zero(q.size()));
  const std::vector<Vec3> wanted = system.right_side(solution.safety), led = system.prescribed();
  links.set_motions(q);
  std::vector<Vec3> start(wanted.size());
  solution.tangent->stiffness.forces(led[0].data(), start[0].data());
  parallel_for_each(start.size(), [&](std::size_t i) { start[i] = wanted[i] - start[i]; });
  // what acts on nodes that links hold is theirs to balance
  if (links.any()) return std::max({std::sqrt(dot(start, start)), system.free_force(), system.load_norm()});
  solution.tangent->stiffness.clear_held(start);
  return std::max(std::sqrt(dot(start, start)), system.free_force());
}

// (nodes x 3) N: right side less what the cells do, of the linear solution.
std::vector<Vec3> unbalanced_of(const QuadraticSystem& system, const QuadraticSolution& solution) {
  const std::vector<Vec3> wanted = system.right_side(solution.safety);
  std::vector<Vec3> left(wanted.size());
  solution.tangent->stiffness.forces(solution.displacement[0].data(), left[0].data());
  parallel_for_each(left.size(), [&](std::size_t i) { left[i] = wanted[i] - left[i]; });
  return left;
}

bool correct_held(const QuadraticSystem& system, double tolerance, QuadraticSolution& solution,
                  const std::function<void(int, double)>& progress);

}  // namespace

QuadraticSolution solve(const QuadraticSystem& system, double tolerance, double safety,
                        const std::string& scene, const std::function<void(int, double)>& progress) {
  QuadraticSolution found;
  found.safety = safety;
  const std::size_t n = system.nodes().size();
  const LinkBalance links(system);
  links.take_small(true);
  for (int attempt = 0; attempt < kSafeties; ++attempt, found.safety *= kMoreSafety) {
    links.set_motions(Eigen::VectorXd::Zero(links.motions().size()));
    found.tangent = std::make_unique<QuadraticTangent>(system.stiffness(found.safety));
    const QuadraticOperator& stiffness = found.tangent->stiffness;
    const QuadraticMultigrid& multigrid =
        found.tangent->multigrid.emplace(stiffness, system.problem().body, system.bonds());
    if (attempt == 0) refuse_free(multigrid, system.problem().body, scene);
    found.displacement = system.prescribed();
    if (system.heated()) start_nearer(system, found);
    found.unbalanced.resize(n);
    if (correct(system, tolerance, found, progress)) return found;
    if (found.iterations >= kMostLinearIterations) break;
  }
  throw DivergedError(
      fmt::format("model \"quadratic\" did not converge: residual {:.2g} after {} iterations; use a smaller "
                  "--size, or model \"cells\"",
                  found.relative_residual, found.iterations));
}

bool correct(const QuadraticSystem& system, double tolerance, QuadraticSolution& solution,
             const std::function<void(int, double)>& progress) {
  if (!correct_held(system, tolerance, solution, progress)) return false;
  LinkBalance links(system);
  if (!links.any()) return true;
  constexpr double kResponse = 1e-8;
  const QuadraticOperator& stiffness = solution.tangent->stiffness;
  LinkedNodes nodes{
      solution.displacement,
      solution.unbalanced,
      solution.turn,
      stiffness,
      [&] { return correct_held(system, tolerance, solution, progress); },
      [&] {
        solution.unbalanced = unbalanced_of(system, solution);
        return true;
      },
      [] {},
      [&](const std::vector<Vec3>& right, std::vector<Vec3>& x) {
        const LinearResult result = conjugate_gradients(
            stiffness, right, x, *solution.tangent->multigrid, kResponse, kMostLinearIterations,
            [&](int iteration, double residual) { progress(solution.iterations + iteration, residual); });
        solution.iterations += result.iterations;
        return !result.indefinite;
      }};
  return links.find(nodes, 1, solution.safety, tolerance);
}

namespace {

bool correct_held(const QuadraticSystem& system, double tolerance, QuadraticSolution& solution,
                  const std::function<void(int, double)>& progress) {
  const QuadraticOperator& stiffness = solution.tangent->stiffness;
  const std::size_t n = system.nodes().size();
  // what links lead to has changed with them
  const std::vector<Vec3> led = system.prescribed();
  for (std::size_t i = 0; i < n; ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (stiffness.held()[i] >> axis & 1) solution.displacement[i][axis] = led[i][axis];
  std::vector<Vec3> left = unbalanced_of(system, solution);
  stiffness.clear_held(left);
  // a body that is held all around has nothing to do, and no scale in what is left of it
  const double scale = scale_of(system, solution), now = std::sqrt(dot(left, left));
  const double asked = std::max(tolerance, kLeastLinearTolerance);
  if (now <= asked * scale && scale > 0) {
    solution.unbalanced = unbalanced_of(system, solution);
    return true;
  }
  const double ahead = scale > 0 ? now / scale : 1;
  std::vector<Vec3> change;
  LinearResult result;
  for (int widened = 0;; ++widened) {
    result = conjugate_gradients(
        stiffness, left, change, *solution.tangent->multigrid, asked / ahead, kMostLinearIterations,
        [&](int iteration, double residual) { progress(solution.iterations + iteration, residual * ahead); });
    solution.iterations += result.iterations;
    solution.relative_residual = result.relative_residual * ahead;
    const bool stopped = !result.converged && !result.indefinite &&
                         result.iterations < kMostLinearIterations &&
                         !(solution.relative_residual < kLinearGoodEnough);
    if (!stopped || widened == kMostWidenings) break;
    solution.tangent->multigrid->widen();
  }
  if (result.iterations == kMostLinearIterations || result.indefinite ||
      !(result.converged || solution.relative_residual < kLinearGoodEnough))
    return false;
  parallel_for_each(n, [&](std::size_t i) { solution.displacement[i] += change[i]; });
  solution.unbalanced = unbalanced_of(system, solution);
  return true;
}

}  // namespace

Mat3 gradient_at(const QuadraticSystem& system, const std::vector<Vec3>& displacement, std::size_t cell,
                 const Vec3& at) {
  const QuadraticShape shape = world_shape(system.lattice(cell), at);
  Mat3 sum = Mat3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    sum += displacement[system.nodes().of_cell[cell][n]] * shape.gradient[n].transpose();
  return sum;
}

const Mat3& turn_of_cell(const QuadraticSolution& solution, std::size_t cell) {
  static const Mat3 none = Mat3::Zero();
  return solution.turn.empty() ? none : solution.turn[cell];
}

Mat3 local_gradient(const QuadraticSystem& system, const QuadraticSolution& solution, std::size_t cell,
                    const Vec3& at) {
  const Mat3 gradient = gradient_at(system, solution.displacement, cell, at);
  const Mat3& turn = turn_of_cell(solution, cell);
  return gradient + turn.transpose() + turn.transpose() * gradient;
}

Mat3 elastic_gradient(const QuadraticSystem& system, const QuadraticSolution& solution, std::size_t cell,
                      const Vec3& at) {
  return local_gradient(system, solution, cell, at) - system.free_strain(cell, at);
}

Vec3 spin_of(const Mat3& h) {
  return 0.5 * Vec3(h(2, 1) - h(1, 2), h(0, 2) - h(2, 0), h(1, 0) - h(0, 1));
}

std::vector<Vec3> element_displacement(const QuadraticSystem& system, const QuadraticSolution& solution) {
  std::vector<Vec3> displacement(system.problem().body.element_count(), Vec3::Zero());
  for (std::size_t i = 0; i < system.nodes().elements.size(); ++i)
    displacement[system.nodes().elements[i]] = solution.displacement[i];
  return displacement;
}

void write_field(const QuadraticNodes& nodes, const QuadraticSolution& solution, const State& state,
                 Body& body) {
  constexpr std::size_t kValues = 3 * kBetweenNodes;
  Column column{static_cast<int>(kValues), std::vector<double>(kValues * body.cell_count(), 0)};
  auto solved = nodes.cells.begin();
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    while (solved != nodes.cells.end() && *solved < c) ++solved;
    const bool resists = solved != nodes.cells.end() && *solved == c;
    const auto index = static_cast<std::size_t>(solved - nodes.cells.begin());
    double* to = &column.values[kValues * c];
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      if (corner_of_node(n) < 8) continue;
      Vec3 u = Vec3::Zero();
      for (std::size_t a = 0; a < 8 && !resists; ++a)
        u += trilinear_weight(n, a) * state.displacement[body.cell_elements[c][a]];
      if (resists) u = solution.displacement[nodes.of_cell[index][n]];
      to = std::copy(u.begin(), u.end(), to);
    }
  }
  body.cell_columns[kQuadraticColumn] = std::move(column);
}

namespace {

// J, of the strain beside the free one; with weights instead of K, so that nothing cancels where there is none.
double heated_energy(const QuadraticSystem& system, const QuadraticSolution& solution,
                     const std::function<Moments(std::size_t)>& moments, bool free) {
  return parallel_sum<double>(
      system.nodes().cells.size(),
      [&](std::size_t c) {
        const Mat9& moduli = system.moduli(system.part_of(c));
        const Moments weights = moments(c);
        double sum = 0;
        for (std::size_t k = 0; k < kMoments; ++k) {
          const Vec3 at = gauss_point(k);
          const Mat3 strain = free ? system.free_strain(c, at) : elastic_gradient(system, solution, c, at);
          sum += 0.5 * weights[static_cast<Eigen::Index>(k)] *
                 strain.cwiseProduct(stress_of(moduli, strain)).sum();
        }
        return sum * system.lattice(c).spacing.prod();
      },
      kAnswerCellsAtATime);
}

// J, of the cells once their rotation is taken out.
double energy_of(const CellProducts<double>& cells, const QuadraticNodes& nodes,
                 const QuadraticSolution& solution) {
  return parallel_sum<double>(
      nodes.cells.size(),
      [&](std::size_t c) {
        const auto local = local_displacement(nodes, c, solution.displacement, turn_of_cell(solution, c));
        CellColumns u = CellColumns::Zero(), force;
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          u.block<3, 1>(static_cast<Eigen::Index>(3 * n), 0) = local[n];
        cells.elastic_forces(c, u, force);
        return 0.5 * u.col(0).dot(force.col(0));
      },
      kAnswerCellsAtATime);
}

}  // namespace

double energy_outside(const QuadraticSystem& system, const QuadraticSolution& solution,
                      double elastic_energy) {
  if (system.heated()) {
    constexpr double kRounding = 1e-12;  // of the energy that it would take to undo the free strain
    const auto all = [&](std::size_t c) { return system.stiffness_moments(c); };
    const auto beyond = [&](std::size_t c) { return Moments(all(c) - system.moments(c)); };
    if (!(elastic_energy > kRounding * heated_energy(system, solution, all, true))) return 0;
    return heated_energy(system, solution, beyond, false) / elastic_energy;
  }
  const double outside = energy_of(system.outside(), system.nodes(), solution);
  return elastic_energy > 0 ? outside / elastic_energy : 0;
}

namespace {

double smallest_jacobian(const QuadraticSystem& system, const QuadraticSolution& solution) {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < system.nodes().cells.size(); ++c)
    smallest = std::min(
        smallest,
        (Mat3::Identity() + gradient_at(system, solution.displacement, c, system.middle(c))).determinant());
  return smallest;
}

// Loads on nodes, where they act: where the nodes are now, or (a linear solution) at rest.
void report_loads(const QuadraticSystem& system, const QuadraticSolution& solution, bool large,
                  SimulateResult& result) {
  const QuadraticNodes& nodes = system.nodes();
  for (std::size_t l = 0; l < system.loads().size(); ++l) {
    const NodalLoad& load = system.loads()[l];
    AppliedLoad total{load.name, Vec3::Zero(), Vec3::Zero()};
    std::vector<Vec3> forces = load.forces;
    if (large) {
      std::fill(forces.begin(), forces.end(), Vec3::Zero());
      load.add_to(solution.displacement, 1, forces);
    }
    for (std::size_t n = 0; n < nodes.size(); ++n)
      add_at(forces[n], large ? Vec3(nodes.rest[n] + solution.displacement[n]) : nodes.rest[n], total.force,
             total.moment);
    total.follower = load.follower != nullptr;
    if (load.couple && load.follower)
      total.rotation = load.follower->turn(
          solution.displacement, l < solution.load_turn.size() ? solution.load_turn[l] : Vec3(Vec3::Zero()));
    else if (load.couple)
      total.rotation = turn_of_couple(nodes.size(), [&](std::size_t n) {
        return LoadedMotion{load.forces[n], nodes.rest[n], solution.displacement[n]};
      });
    result.loads.push_back(total);
  }
}

}  // namespace

void report(const QuadraticSystem& system, const QuadraticSolution& solution, SimulateResult& result) {
  const QuadraticNodes& nodes = system.nodes();
  const bool large = !solution.turn.empty();  // a linear solution has its moments about the places at rest
  const auto place = [&](std::size_t n) {
    return large ? Vec3(nodes.rest[n] + solution.displacement[n]) : nodes.rest[n];
  };
  std::vector<std::uint8_t> counted(nodes.size(), 0);  // a node of two supports counts for the first
  for (const NitscheSupport& support : system.supports()) {
    Reaction reaction{support.tie->name, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), support.tie->is_move};
    for (const FacePoint& at : support.points) {
      const NitschePoint point = system.point(support, at, solution.safety);
      const Mat3& turn = turn_of_cell(solution, at.cell);
      const auto u = values_at(system, solution, at.cell);
      Vec3 moved = Vec3::Zero();
      for (std::size_t n = 0; n < kQuadraticNodes && large; ++n) moved += point.shape.value[n] * u[n];
      reaction.middle += at.position + moved;
      add_at(flexel::simulate::reaction(point, u,
                                        local_displacement(nodes, at.cell, solution.displacement, turn),
                                        Mat3::Identity() + turn),
             at.position + moved, reaction.force, reaction.moment);
    }
    for (const std::uint32_t n : support.nodes) {
      Vec3 held = Vec3::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (support.tie->axes[axis] && !(counted[n] >> axis & 1)) {
          counted[n] = static_cast<std::uint8_t>(counted[n] | 1u << axis);
          held[static_cast<Eigen::Index>(axis)] = -solution.unbalanced[n][static_cast<Eigen::Index>(axis)];
        }
      reaction.middle += place(n);
      add_at(held, place(n), reaction.force, reaction.moment);
    }
    if (!support.tie->link) {
      if (const std::size_t held = support.points.size() + support.nodes.size(); held > 0)
        reaction.middle /= static_cast<double>(held);
      result.reactions.push_back(reaction);
      continue;
    }
    const RigidLink& link = *support.tie->motion.link;
    const Vec3 moved = link.displacement(link.at), at = large ? Vec3(link.at + moved) : link.at;
    const Vec3 force = large ? link.now(link.force) : link.force;
    const Vec3 torque = large ? link.now(link.torque) : link.torque;
    result.loads.push_back({link.name, force, torque + at.cross(force), moved, link.turn, link.follower});
  }
  report_loads(system, solution, large, result);
  result.elastic_energy =
      system.heated()
          ? heated_energy(
                system, solution, [&](std::size_t c) { return system.stiffness_moments(c); }, false)
          : energy_of(solution.tangent->stiffness.cells(), nodes, solution);
  result.smallest_jacobian = std::min(result.smallest_jacobian, smallest_jacobian(system, solution));
}

double typical_strain(const QuadraticSystem& system, const QuadraticSolution& solution) {
  struct Sums {
    double cube = 0, square = 0;
    Sums& operator+=(const Sums& other) {
      cube += other.cube;
      square += other.square;
      return *this;
    }
  };
  const QuadraticNodes& nodes = system.nodes();
  const Sums sums = parallel_sum<Sums>(nodes.cells.size(), [&](std::size_t c) {
    const Mat3 h = elastic_gradient(system, solution, c, system.middle(c));
    const Mat3 strain = 0.5 * (h + h.transpose());
    const double most = Eigen::SelfAdjointEigenSolver<Mat3>(strain, Eigen::EigenvaluesOnly)
                            .eigenvalues()
                            .cwiseAbs()
                            .maxCoeff();
    const double volume =
        system.problem().body.fill[nodes.cells[c]] * system.lattice(c).spacing.prod() * strain.squaredNorm();
    return Sums{volume * most, volume};
  });
  return sums.square > 0 ? sums.cube / sums.square : 0;
}

double mean_strain(const QuadraticSystem& system, const QuadraticSolution& solution) {
  const QuadraticNodes& nodes = system.nodes();
  double stiffness = 0;  // N m
  for (std::size_t c = 0; c < nodes.cells.size(); ++c)
    stiffness +=
        system.stiffest(c) * system.problem().body.fill[nodes.cells[c]] * system.lattice(c).spacing.prod();
  const double energy = energy_of(solution.tangent->stiffness.cells(), nodes, solution);
  return stiffness > 0 ? std::sqrt(2 * energy / stiffness) : 0;
}

}  // namespace flexel::simulate
