// Sums the models and the effects.
#include "simulate/equilibrium/mechanics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/equilibrium/effect_matrix.h"
#include "simulate/matter/fragments.h"
#include "simulate/thermal/free_strain.h"

namespace flexel::simulate {
namespace {

constexpr double kHeldFast = 1e-3;             // of a tie's stiffness in its stiffest direction
constexpr std::size_t kStoredElements = 1000;  // a tangent up to this size is factorised at once anyway

double squared_norm(const std::vector<Vec3>& values) {
  return parallel_sum<double>(values.size(), [&](std::size_t e) { return values[e].squaredNorm(); });
}

bool holds_all_directions(const Block& tie) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(tie), Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[0] > kHeldFast * eigen.eigenvalues()[2];
}

// Elements that nothing resists at (of loose crumbs) stay where they are; in time their inertia carries them.
Constraints initial_constraints(const Problem& problem, const PaperModel& paper) {
  const Body& body = problem.body;
  Constraints constraints;
  constraints.mask.assign(body.element_count(), 0);
  constraints.motion.assign(body.element_count(), {0, 0, 0});
  constraints.motions.push_back({});
  constraints.courses.push_back({});
  if (problem.duration) return constraints;
  const std::vector<std::uint8_t> lone = lone_elements(problem);
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    if (lone[e] && !paper.active()[e]) constraints.mask[e] = 7;
  return constraints;
}

}  // namespace

// Where an effect adds to elements that it does not pull at, the matrix is stored after all.
Mechanics::Lattice::Lattice(const Problem& problem, const PaperModel& paper,
                            const std::vector<ActiveEffect>& effects, bool as_stored)
    : pattern(
          stiffness_pattern(problem.body, active_cells(problem), paper.rows(), coupled(effects), as_stored)),
      cells(problem, pattern.stencil),
      stored(pattern.matrix) {
  if (as_stored) return;
  made.emplace(problem, pattern, effects);
  const State rest{std::vector<Vec3>(problem.body.element_count(), Vec3::Zero()), 1};
  try {
    for (const ActiveEffect& effect : effects)
      if (!effect->tells_where_it_pulls()) effect->add_stiffness(rest, made->added());
  } catch (const MissingBlock&) {
    made.reset();
    pattern.matrix.values.assign(pattern.matrix.columns.size(), Block::Zero());
  }
}

Mechanics::Mechanics(const Problem& problem, std::vector<ActiveEffect> effects, StiffnessStorage storage)
    : problem_(problem),
      body_(problem.body),
      paper_(problem),
      stored_(storage == StiffnessStorage::stored ||
              (storage == StiffnessStorage::automatic &&
               (body_.element_count() <= kStoredElements || !CellStiffness::fits(problem, paper_)))),
      effects_(std::move(effects)),
      constraints_(initial_constraints(problem, paper_)) {
  for (const ActiveEffect& effect : effects_) effect->constrain(constraints_);
  if (body_.cell_columns.contains(kFreeStrainColumn)) {
    std::vector<Vec3> free(body_.element_count(), Vec3::Zero());
    lattice().cells.add_forces({free, 1}, free);
    free_scale_ = std::sqrt(squared_norm(free));
  }
  follow_loads();
}

void Mechanics::follow_loads() {
  const auto follows = [](const ActiveEffect& effect) { return effect->follows(); };
  if (std::any_of(effects_.begin(), effects_.end(), follows)) followed_.emplace(followed(false));
}

FollowedTangent Mechanics::followed(bool symmetric) const {
  return {tangent(), constraints_.mask,
          [this](const std::vector<Vec3>& along, bool transposed, std::vector<Vec3>& change) {
            for (const ActiveEffect& effect : effects_)
              if (effect->follows()) effect->add_force_change(linearised_, along, transposed, change);
          },
          symmetric};
}

std::vector<CoupledElements> Mechanics::coupled(const std::vector<ActiveEffect>& effects) {
  std::vector<CoupledElements> groups;
  for (const ActiveEffect& effect : effects)
    groups.insert(groups.end(), effect.couples.begin(), effect.couples.end());
  return groups;
}

double Mechanics::energy(const State& state) {
  double energy = 0;
  {
    const ScopeTimer timer(cell_seconds_);
    energy = energy_of_cells(state);
  }
  {
    const ScopeTimer timer(paper_seconds_);
    energy += paper_.energy(state);
  }
  for (const ActiveEffect& effect : effects_) energy += effect->energy(state);
  return energy;
}

double Mechanics::elastic_energy(const State& state) {
  return (elsewhere_ ? elsewhere_->figures(state).energy : energy_of_cells(state)) + paper_.energy(state);
}

double Mechanics::energy_of_cells(const State& state) {
  return by_kernels_ ? lattice().made->evaluate(state, true, nullptr).energy : cells().energy(state);
}

bool Mechanics::is_sound(const State& state, const Forces& forces) {
  if (!by_kernels_) return std::isfinite(energy(state));
  return forces.smallest > 0 &&
         std::all_of(effects_.begin(), effects_.end(),
                     [&](const ActiveEffect& effect) { return std::isfinite(effect->energy(state)); });
}

SmallestJacobian Mechanics::smallest_corner_jacobian(const State& state) const {
  return elsewhere_ ? elsewhere_->figures(state).smallest_corner : cells().smallest_corner_jacobian(state);
}

void Mechanics::add_elastic_forces(const State& state, std::vector<Vec3>& forces) {
  (void)add_forces_of_models(state, forces);
}

// The smallest J of a cell, where the kernels tell it.
double Mechanics::add_forces_of_models(const State& state, std::vector<Vec3>& forces) {
  double smallest = 1;
  {
    const ScopeTimer timer(cell_seconds_);
    if (elsewhere_)
      elsewhere_->add_forces(state, forces);
    else if (by_kernels_)
      smallest = lattice().made->evaluate(state, false, &forces).smallest;
    else
      lattice().cells.add_forces(state, forces);
  }
  const ScopeTimer timer(paper_seconds_);
  paper_.add_forces(state, forces);
  return smallest;
}

Forces Mechanics::forces(const State& state) {
  Forces result;
  std::vector<Vec3> inner(body_.element_count(), Vec3::Zero());
  result.total.assign(body_.element_count(), Vec3::Zero());
  for (const ActiveEffect& effect : effects_)
    effect->add_forces(state, effect.couples.empty() ? result.total : inner);
  if (other_pieces()) other_pieces()->sum_at_elements(result.total);
  result.smallest = add_forces_of_models(state, inner);
  const double outer = squared_norm(result.total);
  const double held = parallel_sum<double>(inner.size(), [&](std::size_t e) {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (constraints_.mask[e] >> axis & 1) sum += inner[e][axis] * inner[e][axis];
    return sum;
  });
  result.scale = std::sqrt(outer + held + free_scale_ * free_scale_);
  // Beside an infinite scale every residual would be 0: NaN is below no tolerance.
  if (!std::isfinite(result.scale)) result.scale = std::numeric_limits<double>::quiet_NaN();
  parallel_for_each(inner.size(), [&](std::size_t e) { result.total[e] += inner[e]; });
  return result;
}

std::vector<Vec3> Mechanics::forces_of_effects(const State& state) const {
  std::vector<Vec3> forces(body_.element_count(), Vec3::Zero());
  for (const ActiveEffect& effect : effects_) effect->add_forces(state, forces);
  return forces;
}

BlockMatrix Mechanics::stiffness_of_effects(const State& state) const {
  BlockMatrix matrix = matrix_of_effects(body_, active(), effects_);
  for (const ActiveEffect& effect : effects_) effect->add_stiffness(state, matrix);
  return matrix;
}

void Mechanics::assemble(const State& state, const TangentOptions& tangent) {
  if (follows()) linearised_ = state;
  {
    const ScopeTimer timer(cell_seconds_);
    if (lattice().made)
      lattice().made->linearise(state, tangent);
    else
      lattice().cells.set_stiffness(state, tangent, lattice().pattern.matrix);
  }
  if (!lattice().made) {
    const ScopeTimer timer(paper_seconds_);
    paper_.add_stiffness(state, tangent.project, lattice().pattern.matrix);
  }
  for (std::size_t e = 0; e < inertia_.size(); ++e)
    lattice().added().values[diagonal_position(lattice().added(), e)].diagonal().array() += inertia_[e];
  for (const ActiveEffect& effect : effects_)
    tangent.project ? effect->add_positive_stiffness(state, lattice().added())
                    : effect->add_stiffness(state, lattice().added());
}

void Mechanics::set_inertia(std::vector<double> inertia) {
  by_kernels_ = lattice().made.has_value();
  if (by_kernels_)
    lattice().made->set_inertia(std::move(inertia));
  else
    inertia_ = std::move(inertia);
}

void Mechanics::renew_effects_pattern() {
  if (lattice().made) lattice().made->renew_pattern_of(effects_);
}

void Mechanics::eliminate_prescribed() {
  if (lattice().made)
    lattice().made->eliminate_prescribed(constraints_);
  else
    eliminate(constraints_, lattice().pattern.matrix);
}

bool Mechanics::renew_effects(const State& state) {
  if (!lattice().made || follows()) return false;
  BlockMatrix& added = lattice().made->added();
  std::fill(added.values.begin(), added.values.end(), Block::Zero());
  for (const ActiveEffect& effect : effects_) effect->add_stiffness(state, added);
  return true;
}

bool Mechanics::unilateral() const {
  return std::any_of(effects_.begin(), effects_.end(),
                     [](const ActiveEffect& effect) { return effect->unilateral(); });
}

MostCompressed Mechanics::most_compressed(const State& state) const {
  MostCompressed most;
  if (body_.cell_count() > 0) {
    const SmallestJacobian cell =
        elsewhere_ ? elsewhere_->figures(state).smallest : cells().smallest_jacobian(state);
    if (other_pieces()) return {cell.value, "a cell", other_pieces()->rest_of_corner(cell.cell, 0), 0};
    const std::uint32_t element = body_.cell_elements[cell.cell][0];
    most = {cell.value, fmt::format("cell {}", cell.cell), body_.rest[element],
            element_parts(body_)[element]};
  }
  if (paper_.rows().entries.empty()) return most;
  const PaperModel::SmallestVolume at = paper_.smallest_volume(state);
  if (body_.cell_count() > 0 && most.value <= at.value) return most;
  return {at.value, fmt::format("element {}", at.element), body_.rest[at.element],
          element_parts(body_)[at.element]};
}

std::vector<std::uint8_t> Mechanics::tied_elements() {
  std::vector<std::uint8_t> tied(body_.element_count(), 0);
  BlockMatrix near_effects;
  if (elsewhere_) near_effects = matrix_of_effects(body_, active(), effects_);
  BlockMatrix& matrix = elsewhere_ ? near_effects : lattice().added();
  std::fill(matrix.values.begin(), matrix.values.end(), Block::Zero());
  const State rest{std::vector<Vec3>(body_.element_count(), Vec3::Zero()), 1};
  for (const ActiveEffect& effect : effects_)
    if (effect.couples.empty() && !effect->unilateral()) effect->add_stiffness(rest, matrix);
  for (std::uint32_t e = 0; e < tied.size(); ++e) {
    if (constraints_.mask[e] != 0) tied[e] = constraints_.mask[e] == 7 ? 2 : 1;
    for (std::size_t entry = matrix.row_offsets[e]; entry < matrix.row_offsets[e + 1]; ++entry)
      if (matrix.columns[entry] == e && matrix.values[entry].diagonal().maxCoeff() > 0)
        tied[e] = tied[e] == 2 || holds_all_directions(matrix.values[entry]) ? 2 : 1;
  }
  return tied;
}

void Mechanics::report(const State& state, SimulateResult& result) {
  const Forces unbalanced = forces(state);
  for (const ActiveEffect& effect : effects_) effect->report(state, unbalanced.total, result);
  if (body_.cell_count() > 0)
    result.shares.push_back({"cells", "model of corner-placed parts", cell_seconds_});
  if (!paper_.rows().entries.empty())
    result.shares.push_back({"connections", "model of centre-placed parts", paper_seconds_});
  for (const ActiveEffect& effect : effects_)
    result.shares.push_back({effect.name, effect.why, effect.seconds});
}

}  // namespace flexel::simulate
