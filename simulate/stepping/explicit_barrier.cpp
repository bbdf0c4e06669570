// Each watched cell writes the forces on its corners; they are added up in the order of the cells.
#include "simulate/stepping/explicit_barrier.h"

#include <algorithm>
#include <limits>

#include "base/parallel.h"
#include "simulate/models/cells.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr double kLoss = 0.2;   // of J_c, that asks for another look
constexpr double kDeep = 0.06;  // of its threshold: below it the barrier grows no stiffer

}  // namespace

ExplicitBarrier::ExplicitBarrier(const Problem& problem) : problem_(problem) {
  const Body& body = problem.body;
  const RestShapes shapes(body);
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    kinds_.push_back(cell_kind(part.lattice, problem.materials[p]));
    if (!shapes.any() || (problem.models.size() > p && problem.models[p] == Model::springs)) continue;
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      if (const std::optional<CellKind> own = shapes.of(kinds_[p], part, c))
        shaped_[c] = fold_thresholds(kinds_[p], own);
  }
}

CellVectors ExplicitBarrier::corners(std::uint32_t cell, const std::vector<Vec3>& values) const {
  CellVectors u;
  for (std::size_t a = 0; a < 8; ++a) u[a] = values[problem_.body.cell_elements[cell][a]];
  return u;
}

CornerThresholds ExplicitBarrier::thresholds(std::uint32_t cell) const {
  const auto found = shaped_.find(cell);
  return found != shaped_.end() ? found->second : fold_thresholds(kinds_.front(), std::nullopt);
}

bool ExplicitBarrier::may_fold(std::uint32_t cell, const CellKind& kind, const State& state,
                               double ahead) const {
  const CellVectors u = corners(cell, state.displacement), v = corners(cell, state.velocity);
  if (far_from_folding(kind, u, &v, ahead)) return false;
  const CornerThresholds least = thresholds(cell);
  // Jacobian's rate: the change of J_c over a small part of the way, which is a cubic in time.
  constexpr double kPart = 1e-3;
  CellVectors soon;
  for (std::size_t a = 0; a < 8; ++a) soon[a] = u[a] + kPart * ahead * v[a];
  const CornerVolumes now = corner_volumes(kind, u), then = corner_volumes(kind, soon);
  for (std::size_t c = 0; c < 8; ++c)
    if (least[c] > 0 &&
        (now[c] < 2 * least[c] || now[c] + std::min((then[c] - now[c]) / kPart, 0.0) < least[c]))
      return true;
  return false;
}

void ExplicitBarrier::look(const State& state, double ahead) {
  const Body& body = problem_.body;
  const std::vector<std::uint8_t> active = active_cells(problem_);
  std::vector<std::uint8_t> folds(body.cell_count(), 0);
  const std::vector<double>* change = nullptr;
  if (const auto found = body.cell_columns.find("stiffness_change"); found != body.cell_columns.end())
    change = &found->second.values;
  watched_.clear();
  least_seen_ = std::numeric_limits<double>::infinity();
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    if (problem_.models.size() > p && problem_.models[p] == Model::springs) continue;
    const Part& part = body.parts[p];
    parallel_for_each(part.cell_end - part.cell_begin, [&](std::size_t i) {
      const auto c = static_cast<std::uint32_t>(part.cell_begin + i);
      folds[c] = active[c] && may_fold(c, kinds_[p], state, ahead);
    });
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
      if (!folds[c]) continue;
      Watched& at = watched_.emplace_back();
      at.cell = c;
      at.part = p;
      at.share = body.fill[c] * (change ? 1 + (*change)[c] : 1);
      at.thresholds = thresholds(c);
      least_seen_ =
          std::min(least_seen_, nearest_to_folding(kinds_[p], at.thresholds, corners(c, state.displacement)));
    }
  }
  least_seen_ = std::min(least_seen_, 1 / (1 - kLoss));
  least_ = least_seen_;
  looked_ = true;
}

void ExplicitBarrier::add_forces(const State& state, std::vector<Vec3>& forces) {
  parallel_for_each(watched_.size(), [&](std::size_t i) {
    Watched& at = watched_[i];
    const CellVectors u = corners(at.cell, state.displacement);
    at.forces.fill(Vec3::Zero());
    at.least = nearest_to_folding(kinds_[at.part], at.thresholds, u);
    if (at.least < 1) add_fold_forces(kinds_[at.part], at.thresholds, u, at.forces);
  });
  least_ = std::numeric_limits<double>::infinity();
  for (const Watched& at : watched_) {
    least_ = std::min(least_, at.least);
    if (!(at.least < 1)) continue;
    for (std::size_t a = 0; a < 8; ++a)
      forces[problem_.body.cell_elements[at.cell][a]] += at.share * at.forces[a];
  }
}

bool ExplicitBarrier::needs_step_recheck() const {
  return !looked_ || (least_ < 1 && least_ < least_seen_ - kLoss * std::max(least_seen_, kDeep));
}

double ExplicitBarrier::energy_of(const Watched& at, const State& state) const {
  return at.share * fold_energy(kinds_[at.part], at.thresholds, corners(at.cell, state.displacement));
}

double ExplicitBarrier::energy(const State& state) const {
  double sum = 0;
  for (const Watched& at : watched_) sum += energy_of(at, state);
  return sum;
}

double ExplicitBarrier::drop_broken(const State& state) {
  double released = 0;
  std::erase_if(watched_, [&](const Watched& at) {
    if (!problem_.body.broken[at.cell]) return false;
    released += energy_of(at, state);
    return true;
  });
  return released;
}

}  // namespace flexel::simulate
