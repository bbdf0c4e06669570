// Products go over the chunks of simulate/kernels/chunk_layout.h: a chunk writes the rows of the elements that it owns
// and hands over what it adds to those that it shares; those are summed in a fixed order. Rows are made for
// each element from the cells around it, in ascending order, so neither depends on the threads.
// Everything about a cell is in its lattice's frame; a row's blocks are turned to the world's at its end.
#include "simulate/equilibrium/cell_stiffness.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/instruction_set.h"
#include "base/parallel.h"
#include "simulate/equilibrium/effect_matrix.h"
#include "simulate/kernels/scratch.h"
#include "simulate/models/corner_barrier.h"
#include "simulate/models/prepared_cell.h"

namespace flexel::simulate {
namespace {

using step::kLanes;
using step::TangentForm;

const step::ProductTable& product_table() {
#if defined(__x86_64__)
  return best_table(&step::products_portable, &step::products_avx2, &step::products_avx512);
#else
  return step::products_portable();
#endif
}

const step::KernelTable& evaluation_table() {
#if defined(__x86_64__)
  return best_table(&step::kernels_portable, &step::kernels_avx2, &step::kernels_avx512);
#else
  return step::kernels_portable();
#endif
}

StepLayout layout_of(const Problem& problem) {
  KernelEffects plan;
  plan.damping.assign(problem.body.parts.size(), 0);
  plan.rest_shapes = true;  // so that it says which cell each lane holds
  return step_layout(problem, plan);
}

// Whether rows `e` and `other` hold the same blocks of cells at rest at the same places: inside a part most
// do.
bool same_row(const StiffnessPattern& pattern, const std::vector<std::uint32_t>& part,
              const std::vector<double>& share, std::size_t e, std::size_t other) {
  const auto cells = pattern.stencil.of(static_cast<std::uint32_t>(e));
  const auto others = pattern.stencil.of(static_cast<std::uint32_t>(other));
  const auto& offsets = pattern.matrix.row_offsets;
  if (offsets[e + 1] - offsets[e] != offsets[other + 1] - offsets[other]) return false;
  return std::equal(
      cells.begin(), cells.end(), others.begin(), others.end(), [&](const Incidence& a, const Incidence& b) {
        const std::uint16_t* slot = pattern.stencil.slot[a.cell].data() + 8 * a.corner;
        return a.corner == b.corner && share[a.cell] == share[b.cell] && part[a.cell] == part[b.cell] &&
               std::equal(slot, slot + 8, pattern.stencil.slot[b.cell].data() + 8 * b.corner);
      });
}

constexpr int kStressOf[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

// From the columns of one lane; lattice frame.
HourglassTangent hourglass_of(const CellKind& kind, const double* from) {
  HourglassTangent made;
  Eigen::Matrix<double, 9, 1> p;
  for (int m = 0; m < 3; ++m)
    for (int i = 0; i < 3; ++i) {
      made.inverse_transpose(m, i) = from[kLanes * static_cast<std::size_t>(3 * m + i)];
      p[3 * m + i] = from[kLanes * static_cast<std::size_t>(9 + 3 * m + i)];
    }
  made.pull = made.inverse_transpose.transpose();
  made.jacobian = from[kLanes * 18];
  const Eigen::Matrix<double, 9, 1> s = (from[kLanes * 19] * made.jacobian) * (kind.by_mode * p);
  made.energy = 0.5 * p.dot(s);
  for (int m = 0; m < 3; ++m) {
    made.arm[static_cast<std::size_t>(m)] = p.segment<3>(3 * m);
    made.force[static_cast<std::size_t>(m)] = made.inverse_transpose * s.segment<3>(3 * m);
  }
  return made;
}

}  // namespace

bool CellStiffness::fits(const Problem& problem, const PaperModel& paper) {
  const auto cells = [](Model model) { return model == Model::cells; };
  return problem.body.cell_count() > 0 && paper.rows().entries.empty() &&
         std::find(paper.active().begin(), paper.active().end(), 1) == paper.active().end() &&
         std::all_of(problem.models.begin(), problem.models.end(), cells) && !RestShapes(problem.body).any();
}

CellStiffness::CellStiffness(const Problem& problem, const StiffnessPattern& pattern,
                             const std::vector<ActiveEffect>& effects)
    : body_(problem.body),
      pattern_(pattern),
      layout_(layout_of(problem)),
      kernels_(&product_table()),
      active_(active_cells(problem)),
      part_(cell_parts(problem.body)),
      share_(stiffness_shares(problem.body)),
      place_(problem.body.cell_count()),
      added_(matrix_of_effects(problem.body, pattern.matrix, effects)),
      shared_force_(3 * layout_.shared.size()) {
  for (std::size_t block = 0; block < layout_.block_cells.size(); ++block)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (const std::uint32_t cell = layout_.block_cells[block][lane]; cell != StepLayout::kNoCell)
        place_[cell] = static_cast<std::uint32_t>(block * kLanes + lane);
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    const Lattice& lattice = body_.parts[p].lattice;
    PartKind made{cell_kind_in_lattice(lattice, problem.materials[p]),
                  cell_kind(lattice, problem.materials[p]),
                  lattice.axes,
                  {}};
    made.at_rest = blocks_at_rest(made.turned);
    by_moduli_ = by_moduli_ || made.kind.law.name != LawName::neo_hooke;
    kinds_.push_back(made);
  }
}

void CellStiffness::renew_pattern_of(const std::vector<ActiveEffect>& effects) {
  added_ = matrix_of_effects(body_, pattern_.matrix, effects);
  adding_.reset();
}

void CellStiffness::prepare_kernels() {
  work_.kernels = &evaluation_table();
  work_.ones.assign(body_.element_count(), 1);
  for (step::CellConstants& constants : layout_.constants) {
    constants.damping = 0;
    constants.yield = constants.strength = constants.elongation = std::numeric_limits<double>::infinity();
  }
}

// One advance of unit masses from rest for a unit of time, in which nothing moves: velocities are the forces.
CellStiffness::Evaluation CellStiffness::run_kernels(bool energy) {
  struct Sum {
    double elastic = 0, smallest = std::numeric_limits<double>::infinity();
    Sum& operator+=(const Sum& other) {
      elastic += other.elastic;
      smallest = other.smallest >= smallest ? smallest : other.smallest;  // one that is not a number wins
      return *this;
    }
  };
  const step::Composition has{energy ? step::Damping::book : step::Damping::none, false, energy};
  work_.damping.resize(energy ? 3 * work_.places.size() : 0);
  work_.shared_damping.resize(energy ? shared_force_.size() : 0);
  // The kernels that tell the energy break cells that have turned inside out.
  std::vector<step::CellBlock> breakable;
  if (energy) breakable = layout_.blocks;
  step::CellBlock* const blocks = energy ? breakable.data() : layout_.blocks.data();
  const step::StateView view{work_.places.data()->data(), work_.pulls.data()->data(), nullptr,
                             work_.ones.data(), energy ? work_.damping.data() : nullptr};
  const std::size_t doubles = step::kScratchColumns * step::scratch_stride(layout_.largest_chunk) +
                              step::kScratchAlignment / sizeof(double);
  const Sum sum = parallel_sum<Sum>(
      layout_.chunks.size(),
      [&](std::size_t i) {
        thread_local std::vector<double> scratch;
        if (scratch.size() < doubles) scratch.resize(doubles);
        const StepLayout::Chunk& chunk = layout_.chunks[i];
        step::ChunkView of = {};
        of.blocks = blocks + chunk.block_begin;
        of.corners = layout_.corners.data() + chunk.corner_begin;
        of.block_count = chunk.block_end - chunk.block_begin;
        of.cell_fill = layout_.cell_fill.data() + chunk.fill_begin;
        of.elements = layout_.elements.data() + chunk.element_begin;
        of.count = chunk.element_end - chunk.element_begin;
        of.owned = layout_.owned.data() + chunk.owned_begin;
        of.shared = layout_.shared.data() + chunk.shared_begin;
        of.owned_count = chunk.owned_end - chunk.owned_begin;
        of.shared_count = chunk.shared_end - chunk.shared_begin;
        of.shared_force = shared_force_.data() + 3 * chunk.shared_begin;
        if (energy) of.shared_damping = work_.shared_damping.data() + 3 * chunk.shared_begin;
        of.constants = &layout_.constants[chunk.kind];
        const step::ChunkOutcome outcome = work_.kernels->cells[step::variant_number(has)](
            of, view, {1, 0, false}, step::first_aligned(scratch));
        return Sum{outcome.elastic, outcome.smallest_jacobian};
      },
      1);
  return {sum.elastic, sum.smallest};
}

// What keeps corners from folding, which the kernels do not have.
void CellStiffness::add_corners(const State& state, Evaluation& made, std::vector<Vec3>* forces) const {
  constexpr std::size_t kGrain = 512;
  std::vector<std::vector<std::uint32_t>> near((body_.cell_count() + kGrain - 1) / kGrain);
  const auto corners = [&](std::size_t c) {
    CellVectors u;
    for (std::size_t a = 0; a < 8; ++a) u[a] = state.displacement[body_.cell_elements[c][a]];
    return u;
  };
  parallel_chunks(body_.cell_count(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      if (active_[c] && !far_from_folding(kinds_[part_[c]].turned, corners(c)))
        near[begin / kGrain].push_back(static_cast<std::uint32_t>(c));
  });
  for (const std::vector<std::uint32_t>& chunk : near)
    for (const std::uint32_t c : chunk) {
      const CellKind& kind = kinds_[part_[c]].turned;
      const CornerThresholds thresholds = fold_thresholds(kind, std::nullopt);
      const CellVectors u = corners(c);
      const double energy = share_[c] * fold_energy(kind, thresholds, u);
      made.energy += energy;
      if (!std::isfinite(energy)) made.smallest = std::min(made.smallest, 0.0);
      if (!forces || energy == 0) continue;
      CellVectors force;
      force.fill(Vec3::Zero());
      add_fold_forces(kind, thresholds, u, force);
      for (std::size_t a = 0; a < 8; ++a) (*forces)[body_.cell_elements[c][a]] += share_[c] * force[a];
    }
}

CellStiffness::Evaluation CellStiffness::evaluate(const State& state, bool energy,
                                                  std::vector<Vec3>* forces) {
  if (!work_.kernels) prepare_kernels();
  work_.places = state.displacement;
  work_.pulls.assign(work_.places.size(), Vec3::Zero());
  Evaluation made = run_kernels(energy);
  if (forces) {
    parallel_for_each(forces->size(), [&](std::size_t e) { (*forces)[e] += work_.pulls[e]; });
    parallel_for_each(layout_.shared_elements.size(), [&](std::size_t i) {
      Vec3& sum = (*forces)[layout_.shared_elements[i]];
      for (std::uint32_t slot = layout_.slot_offsets[i]; slot < layout_.slot_offsets[i + 1]; ++slot)
        sum += Eigen::Map<const Vec3>(shared_force_.data() + 3 * std::size_t{layout_.slots[slot]});
    });
  }
  add_corners(state, made, forces);
  if (energy && !(made.smallest > 0)) made.energy = std::numeric_limits<double>::infinity();
  return made;
}

// The columns of one lane.
void CellStiffness::prepare_lane(std::uint32_t cell, const State& state, const TangentOptions& tangent,
                                 double* to) const {
  const PartKind& part = kinds_[part_[cell]];
  const Mat3& axes = part.axes;
  CellVectors u;
  for (std::size_t a = 0; a < 8; ++a)
    u[a] = axes.transpose() * state.displacement[body_.cell_elements[cell][a]];
  Mat3 stress;
  if (tangent.stress) stress = axes.transpose() * (*tangent.stress)[cell] * axes;
  const Mat3* given = tangent.stress ? &stress : nullptr;
  PreparedCell prepared;
  if (form_ == TangentForm::moduli) {
    prepared.hourglass = hourglass_tangent(part.kind, u, tangent.project);
    const Mat9 moduli =
        prepare_moduli(part.kind, displacement_gradient(part.kind, u), tangent.project, given);
    for (std::size_t c = 0; c < 81; ++c)
      to[kLanes * (step::kHourglassColumns + c)] =
          moduli(static_cast<Eigen::Index>(c / 9), static_cast<Eigen::Index>(c % 9));
  } else {
    prepared = prepare_cell(part.kind, u, tangent.project, given);
    double* mean = to + kLanes * step::kHourglassColumns;
    mean[0] = prepared.coupling;
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3 && prepared.added_stress; ++j)
        mean[kLanes * static_cast<std::size_t>(1 + kStressOf[i][j])] = (*prepared.added_stress)(i, j);
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const auto column = 3 * static_cast<std::size_t>(i) + static_cast<std::size_t>(j);
      to[kLanes * column] = prepared.hourglass.inverse_transpose(i, j);
      to[kLanes * (9 + column)] = prepared.hourglass.arm[static_cast<std::size_t>(i)][j];
    }
  to[kLanes * 18] = prepared.hourglass.jacobian;
  to[kLanes * 19] = tangent.project ? 0 : 1;
}

void CellStiffness::find_folding(const State& state, bool project) {
  constexpr std::size_t kGrain = 4096;
  std::vector<std::vector<Folding>> found((body_.cell_count() + kGrain - 1) / kGrain);
  parallel_chunks(body_.cell_count(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      if (!active_[c]) continue;
      const CellKind& kind = kinds_[part_[c]].turned;
      CellVectors u;
      for (std::size_t a = 0; a < 8; ++a) u[a] = state.displacement[body_.cell_elements[c][a]];
      if (far_from_folding(kind, u)) continue;
      auto blocks = fold_tangent(kind, fold_thresholds(kind, std::nullopt), u, project);
      if (!blocks) continue;
      for (Block& block : *blocks) block *= share_[c];
      found[begin / kGrain].push_back({static_cast<std::uint32_t>(c), *blocks});
    }
  });
  for (const std::vector<Folding>& chunk : found) folding_.insert(folding_.end(), chunk.begin(), chunk.end());
}

// Null where it does not fold.
const FoldTangent* CellStiffness::folding_of(std::uint32_t cell) const {
  const auto at = std::lower_bound(folding_.begin(), folding_.end(), cell,
                                   [](const Folding& each, std::uint32_t c) { return each.cell < c; });
  return at != folding_.end() && at->cell == cell ? &at->blocks : nullptr;
}

void CellStiffness::linearise(const State& state, const TangentOptions& tangent) {
  std::fill(added_.values.begin(), added_.values.end(), Block::Zero());
  adding_.reset();
  cells_diagonal_.clear();
  folding_.clear();
  mask_.clear();
  held_.clear();
  const bool rest = std::all_of(state.displacement.begin(), state.displacement.end(),
                                [](const Vec3& u) { return u == Vec3::Zero(); });
  form_ = rest && !tangent.stress                              ? TangentForm::at_rest
          : by_moduli_ || (tangent.project && !tangent.stress) ? TangentForm::moduli
                                                               : TangentForm::deformed;
  const std::size_t width = kLanes * step::kTangentColumns[static_cast<std::size_t>(form_)];
  tangents_.assign(width * layout_.blocks.size(), 0);
  if (form_ == TangentForm::at_rest) {
    tangents_.shrink_to_fit();
    return;
  }
  find_folding(state, tangent.project);
  parallel_for_each(
      layout_.blocks.size(),
      [&](std::size_t block) {
        for (std::size_t lane = 0; lane < kLanes; ++lane)
          if (const std::uint32_t cell = layout_.block_cells[block][lane]; cell != StepLayout::kNoCell)
            prepare_lane(cell, state, tangent, tangents_.data() + width * block + lane);
      },
      64);
}

void CellStiffness::eliminate_prescribed(const Constraints& constraints) {
  if (!mask_.empty()) return;
  for (std::uint32_t e = 0; e < constraints.mask.size(); ++e)
    if (constraints.mask[e]) held_.push_back(e);
  if (held_.empty()) return;
  held_diagonal_.resize(held_.size());
  parallel_for_each(held_.size(), [&](std::size_t h) {
    Block own = cells_diagonal_.empty() ? diagonal_of_cells(held_[h]) : cells_diagonal_[held_[h]];
    add_others(held_[h], own);
    for (int axis = 0; axis < 3; ++axis) held_diagonal_[h][axis] = own(axis, axis) > 0 ? own(axis, axis) : 1;
  });
  mask_ = constraints.mask;
}

void CellStiffness::products_of_cells(const double* x, double* y) const {
  const std::size_t doubles = step::kProductColumns * step::scratch_stride(layout_.largest_chunk) +
                              step::kScratchAlignment / sizeof(double);
  const auto form = static_cast<std::size_t>(form_);
  const std::size_t width = kLanes * step::kTangentColumns[form];
  parallel_for_each(
      layout_.chunks.size(),
      [&](std::size_t i) {
        thread_local std::vector<double> scratch;
        if (scratch.size() < doubles) scratch.resize(doubles);
        const StepLayout::Chunk& chunk = layout_.chunks[i];
        step::ChunkView view = {};
        view.blocks = const_cast<step::CellBlock*>(layout_.blocks.data()) + chunk.block_begin;  // only read
        view.block_count = chunk.block_end - chunk.block_begin;
        view.corners = layout_.corners.data() + chunk.corner_begin;
        view.elements = layout_.elements.data() + chunk.element_begin;
        view.count = chunk.element_end - chunk.element_begin;
        view.owned = layout_.owned.data() + chunk.owned_begin;
        view.owned_count = chunk.owned_end - chunk.owned_begin;
        view.shared = layout_.shared.data() + chunk.shared_begin;
        view.shared_count = chunk.shared_end - chunk.shared_begin;
        view.shared_force = shared_force_.data() + 3 * chunk.shared_begin;
        view.constants = &layout_.constants[chunk.kind];
        kernels_->of[form](view, tangents_.data() + width * chunk.block_begin, x, y,
                           step::first_aligned(scratch));
      },
      1);
  parallel_for_each(layout_.shared_elements.size(), [&](std::size_t i) {
    double* to = y + 3 * std::size_t{layout_.shared_elements[i]};
    to[0] = to[1] = to[2] = 0;
    for (std::uint32_t s = layout_.slot_offsets[i]; s < layout_.slot_offsets[i + 1]; ++s)
      for (std::size_t c = 0; c < 3; ++c) to[c] += shared_force_[3 * std::size_t{layout_.slots[s]} + c];
  });
  for (const std::uint32_t e : layout_.lone_elements)
    for (std::size_t c = 0; c < 3; ++c) y[3 * std::size_t{e} + c] = 0;
}

CellStiffness::Adding CellStiffness::adding() const {
  Adding result;
  const auto count = static_cast<std::size_t>(std::count_if(
      added_.values.begin(), added_.values.end(), [](const Block& block) { return block != Block::Zero(); }));
  result.columns.reserve(count);
  result.values.reserve(count);
  for (std::uint32_t e = 0; e < body_.element_count(); ++e) {
    const std::size_t before = result.columns.size();
    for (std::uint64_t q = added_.row_offsets[e]; q < added_.row_offsets[e + 1]; ++q)
      if (added_.values[q] != Block::Zero()) {
        result.columns.push_back(added_.columns[q]);
        result.values.push_back(added_.values[q]);
      }
    if (result.columns.size() == before) continue;
    result.rows.push_back(e);
    result.offsets.push_back(before);
  }
  result.offsets.push_back(result.columns.size());
  return result;
}

void CellStiffness::multiply(const double* x, double* y) const {
  const double* from = x;
  if (!held_.empty()) {
    masked_.assign(x, x + 3 * body_.element_count());
    for (const std::uint32_t e : held_)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (mask_[e] >> axis & 1) masked_[3 * std::size_t{e} + axis] = 0;
    from = masked_.data();
  }
  products_of_cells(from, y);
  for (const Folding& each : folding_) {
    const auto& elements = body_.cell_elements[each.cell];
    for (std::size_t ab = 0; ab < 64; ++ab)
      Eigen::Map<Vec3>(y + 3 * std::size_t{elements[ab / 8]}) +=
          each.blocks[ab] * Eigen::Map<const Vec3>(from + 3 * std::size_t{elements[ab % 8]});
  }
  if (!inertia_.empty())
    parallel_for_each(inertia_.size(), [&](std::size_t e) {
      Eigen::Map<Vec3>(y + 3 * e) += inertia_[e] * Eigen::Map<const Vec3>(from + 3 * e);
    });
  if (!adding_) adding_ = adding();
  parallel_for_each(adding_->rows.size(), [&](std::size_t r) {
    double sum[3] = {};
    for (std::uint64_t q = adding_->offsets[r]; q < adding_->offsets[r + 1]; ++q) {
      const double* block = adding_->values[q].data();
      const double* at = from + 3 * std::size_t{adding_->columns[q]};
      for (int i = 0; i < 3; ++i)
        sum[i] += block[3 * i] * at[0] + block[3 * i + 1] * at[1] + block[3 * i + 2] * at[2];
    }
    for (std::size_t i = 0; i < 3; ++i) y[3 * std::size_t{adding_->rows[r]} + i] += sum[i];
  });
  for (std::size_t h = 0; h < held_.size(); ++h)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (mask_[held_[h]] >> axis & 1) {
        const std::size_t k = 3 * std::size_t{held_[h]} + axis;
        y[k] = held_diagonal_[h][static_cast<Eigen::Index>(axis)] * x[k];
      }
}

// Without the hourglass stiffness by mode.
void CellStiffness::mean_blocks(const CellKind& kind, const double* from, double share, std::size_t a,
                                std::size_t begin, std::size_t end, Block* out) const {
  const double* mean = from + kLanes * step::kHourglassColumns;
  if (form_ == TangentForm::moduli) {
    Mat9 moduli;
    for (std::size_t c = 0; c < 81; ++c)
      moduli(static_cast<Eigen::Index>(c / 9), static_cast<Eigen::Index>(c % 9)) = mean[kLanes * c];
    for (std::size_t b = begin; b < end; ++b) out[b] = share * projected_block(kind, moduli, a, b);
    return;
  }
  Mat3 g, added;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      g(i, j) = from[kLanes * static_cast<std::size_t>(3 * i + j)];
      added(i, j) = mean[kLanes * static_cast<std::size_t>(1 + kStressOf[i][j])];
    }
  const double scale = share * kind.volume / 16;
  const Vec3 w_a = g * kind.gradient[a];
  const Vec3 symmetric = (scale * kind.lambda) * w_a, swapped = (scale * mean[0]) * w_a;
  const Vec3 stressed = scale * (added * kind.gradient[a]);
  for (std::size_t b = begin; b < end; ++b) {
    const Vec3 w_b = g * kind.gradient[b];
    out[b].noalias() = symmetric * w_b.transpose();
    out[b].noalias() += w_b * swapped.transpose();
    out[b].diagonal().array() += share * kind.diagonal[8 * a + b] + stressed.dot(kind.gradient[b]);
  }
}

const double* CellStiffness::tangent_of(std::uint32_t cell) const {
  const std::size_t width = kLanes * step::kTangentColumns[static_cast<std::size_t>(form_)];
  const std::uint32_t place = place_[cell];
  return tangents_.data() + width * (place / kLanes) + place % kLanes;
}

void CellStiffness::cell_blocks(const Incidence& at, std::size_t begin, std::size_t end, Block* out) const {
  const PartKind& part = kinds_[part_[at.cell]];
  const double share = share_[at.cell];
  if (form_ == TangentForm::at_rest) {
    for (std::size_t b = begin; b < end; ++b) out[b] = share * part.at_rest[8 * at.corner + b];
    return;
  }
  const double* from = tangent_of(at.cell);
  mean_blocks(part.kind, from, share, at.corner, begin, end, out);
  add_hourglass_row(part.kind, hourglass_of(part.kind, from), share, at.corner, begin, end, out);
}

// To the world's frame, where the blocks of cells are in the lattice's.
void CellStiffness::turn(std::size_t element, Block* block, std::size_t count) const {
  const std::span<const Incidence> cells = pattern_.stencil.of(static_cast<std::uint32_t>(element));
  if (form_ == TangentForm::at_rest || cells.empty()) return;
  const Mat3& axes = kinds_[part_[cells.front().cell]].axes;
  if (axes == Mat3::Identity()) return;
  for (std::size_t b = 0; b < count; ++b) block[b] = (axes * block[b] * axes.transpose()).eval();
}

void CellStiffness::add_effects(std::size_t element, Block* row) const {
  const std::uint64_t first = row_offsets()[element];
  for (std::uint64_t q = added_.row_offsets[element]; q < added_.row_offsets[element + 1]; ++q)
    row[position_of(pattern_.matrix, element, added_.columns[q]) - first] += added_.values[q];
}

void CellStiffness::eliminate_row(std::size_t element, Block* row) const {
  const std::uint64_t begin = row_offsets()[element], end = row_offsets()[element + 1];
  for (std::uint64_t q = begin; q < end; ++q) {
    const std::uint32_t column = columns()[q];
    if (!mask_[element] && !mask_[column]) continue;
    Block& block = row[q - begin];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        if (!(mask_[element] >> i & 1) && !(mask_[column] >> j & 1)) continue;
        const bool stays = element == column && i == j;
        block(i, j) = !stays ? 0 : block(i, j) > 0 ? block(i, j) : 1;
      }
  }
}

const Block* CellStiffness::blocks(std::size_t begin, std::size_t end, std::vector<Block>& room) const {
  room.resize(row_offsets()[end] - row_offsets()[begin]);
  thread_local std::vector<Block> last;  // the cells' share of row `made`
  std::size_t made = end;
  std::array<Block, 8> own;
  for (std::size_t e = begin; e < end; ++e) {
    Block* row = room.data() + (row_offsets()[e] - row_offsets()[begin]);
    Block* row_end = room.data() + (row_offsets()[e + 1] - row_offsets()[begin]);
    if (form_ == TangentForm::at_rest && made != end && same_row(pattern_, part_, share_, e, made)) {
      std::copy(last.begin(), last.end(), row);
    } else {
      std::fill(row, row_end, Block::Zero());
      for (const Incidence& at : pattern_.stencil.of(static_cast<std::uint32_t>(e))) {
        cell_blocks(at, 0, 8, own.data());
        const std::uint16_t* slot = pattern_.stencil.slot[at.cell].data() + 8 * at.corner;
        for (std::size_t b = 0; b < 8; ++b) row[slot[b]] += own[b];
      }
      turn(e, row, row_offsets()[e + 1] - row_offsets()[e]);
      last.assign(row, row_end);
      made = e;
    }
    if (!folding_.empty())
      for (const Incidence& at : pattern_.stencil.of(static_cast<std::uint32_t>(e)))
        if (const FoldTangent* blocks = folding_of(at.cell))
          for (std::size_t b = 0; b < 8; ++b)
            row[pattern_.stencil.slot[at.cell][8 * at.corner + b]] += (*blocks)[8 * at.corner + b];
    if (!inertia_.empty())
      row[diagonal_position(pattern_.matrix, e) - row_offsets()[e]].diagonal().array() += inertia_[e];
    add_effects(e, row);
    if (!mask_.empty()) eliminate_row(e, row);
  }
  return room.data();
}

Block CellStiffness::diagonal_of_cells(std::size_t element) const {
  std::array<Block, 8> own;
  Block sum = Block::Zero();
  for (const Incidence& at : pattern_.stencil.of(static_cast<std::uint32_t>(element))) {
    cell_blocks(at, at.corner, at.corner + 1, own.data());
    sum += own[at.corner];
  }
  turn(element, &sum, 1);
  return sum;
}

// Of all eight corners, for less than two of them take one by one.
void CellStiffness::deformed_diagonal(std::uint32_t cell, std::array<Block, 8>& out) const {
  const double* from = tangent_of(cell);
  const CellKind& kind = kinds_[part_[cell]].kind;
  for (std::size_t b = 0; b < 4; ++b) {
    mean_blocks(kind, from, share_[cell], b, b, b + 1, out.data());
    // The gradient's sign is all that the opposite corner differs in.
    out[7 - b] = out[b];
  }
  add_hourglass_diagonal(kind, hourglass_of(kind, from), share_[cell], out.data());
}

// By the chunks of products_of_cells(), lattice frame.
void CellStiffness::set_deformed_diagonals(std::vector<Block>& diagonal) const {
  std::vector<Block> shared(layout_.shared.size());
  parallel_for_each(
      layout_.chunks.size(),
      [&](std::size_t i) {
        const StepLayout::Chunk& chunk = layout_.chunks[i];
        const std::uint16_t* corners = layout_.corners.data() + chunk.corner_begin;
        std::vector<Block> sum(chunk.element_end - chunk.element_begin, Block::Zero());
        std::array<Block, 8> own;
        for (std::size_t b = chunk.block_begin; b < chunk.block_end; ++b) {
          const step::CellBlock& block = layout_.blocks[b];
          const std::uint16_t* corner = corners + block.corners;
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const std::uint32_t cell = layout_.block_cells[b][lane];
            if (cell == StepLayout::kNoCell) continue;
            deformed_diagonal(cell, own);
            for (std::size_t a = 0; a < 8; ++a)
              sum[block.is_run ? corner[a] + lane : corner[kLanes * a + lane]] += own[a];
          }
        }
        for (std::size_t q = chunk.owned_begin; q < chunk.owned_end; ++q)
          diagonal[layout_.elements[chunk.element_begin + layout_.owned[q]]] = sum[layout_.owned[q]];
        for (std::size_t q = chunk.shared_begin; q < chunk.shared_end; ++q)
          shared[q] = sum[layout_.shared[q]];
      },
      1);
  parallel_for_each(layout_.shared_elements.size(), [&](std::size_t i) {
    Block sum = Block::Zero();
    for (std::uint32_t s = layout_.slot_offsets[i]; s < layout_.slot_offsets[i + 1]; ++s)
      sum += shared[layout_.slots[s]];
    diagonal[layout_.shared_elements[i]] = sum;
  });
  for (const std::uint32_t e : layout_.lone_elements) diagonal[e].setZero();
}

std::vector<Block> CellStiffness::diagonals_of_cells() const {
  std::vector<Block> diagonal(rows());
  if (form_ == TangentForm::at_rest) {
    parallel_for_each(rows(), [&](std::size_t e) { diagonal[e] = diagonal_of_cells(e); });
    return diagonal;
  }
  set_deformed_diagonals(diagonal);
  parallel_for_each(rows(), [&](std::size_t e) { turn(e, &diagonal[e], 1); });
  return diagonal;
}

// What resists beside the smooth part of the cells.
void CellStiffness::add_others(std::size_t e, Block& own) const {
  if (!folding_.empty())
    for (const Incidence& at : pattern_.stencil.of(static_cast<std::uint32_t>(e)))
      if (const FoldTangent* blocks = folding_of(at.cell)) own += (*blocks)[9 * at.corner];
  if (!inertia_.empty()) own.diagonal().array() += inertia_[e];
  if (added_.row_offsets[e + 1] > added_.row_offsets[e]) own += added_.values[diagonal_position(added_, e)];
}

std::vector<Block> CellStiffness::diagonal() const {
  if (keeps_diagonal_ && cells_diagonal_.empty()) cells_diagonal_ = diagonals_of_cells();
  std::vector<Block> diagonal = keeps_diagonal_ ? cells_diagonal_ : diagonals_of_cells();
  parallel_for_each(rows(), [&](std::size_t e) {
    add_others(e, diagonal[e]);
    if (!mask_.empty() && mask_[e])
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          if ((mask_[e] >> i & 1) || (mask_[e] >> j & 1))
            diagonal[e](i, j) = i != j ? 0 : diagonal[e](i, j) > 0 ? diagonal[e](i, j) : 1;
  });
  return diagonal;
}

}  // namespace flexel::simulate
