// Cells over a body. Forces go in two passes without races: each cell writes the forces on its corners, then
// each element gathers those of its cells in ascending order. The stiffness is gathered too, row by row, so
// every sum has a fixed order and the bits do not depend on the number of threads.
#include "simulate/models/cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "base/parallel.h"
#include "base/units.h"
#include "simulate/models/prepared_cell.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kCellGrain = 512;

void add_cell_row(const CellKind& kind, const PreparedCell& cell, double fill, std::size_t a,
                  const std::array<std::uint16_t, 64>& slot, Block* row) {
  if (cell.folding)
    for (std::size_t b = 0; b < 8; ++b) row[slot[8 * a + b]] += fill * (*cell.folding)[8 * a + b];
  std::array<Block, 8> own;
  own.fill(Block::Zero());
  add_hourglass_row(kind, cell.hourglass, fill, a, 0, 8, own.data());
  for (std::size_t b = 0; b < 8; ++b) row[slot[8 * a + b]] += own[b];
  if (cell.moduli) {
    for (std::size_t b = 0; b < 8; ++b)
      row[slot[8 * a + b]] += fill * projected_block(kind, *cell.moduli, a, b);
    return;
  }
  const double scale = fill * kind.volume / 16;
  const Vec3 w_a = cell.tangent.inverse_transpose * kind.gradient[a];
  const Vec3 symmetric = (scale * kind.lambda) * w_a;
  const Vec3 swapped = (scale * cell.coupling) * w_a;
  const Vec3 added =
      cell.added_stress ? Vec3(scale * (*cell.added_stress * kind.gradient[a])) : Vec3(Vec3::Zero());
  for (std::size_t b = 0; b < 8; ++b) {
    const Vec3 w_b = cell.tangent.inverse_transpose * kind.gradient[b];
    Block& block = row[slot[8 * a + b]];
    block.noalias() += symmetric * w_b.transpose();
    block.noalias() += w_b * swapped.transpose();
    block.diagonal().array() += fill * kind.diagonal[8 * a + b] + added.dot(kind.gradient[b]);
  }
}

void add_spring_row(const SpringKind& kind, const CellVectors& u, double fill, std::size_t a, bool project,
                    const std::array<std::uint16_t, 64>& slot, Block* row) {
  for (const Spring& spring : kind.springs) {
    if (spring.a != a && spring.b != a) continue;
    const Block block = fill * spring_block(spring, u, project);
    row[slot[9 * a]] += block;
    row[slot[8 * a + (spring.a == a ? spring.b : spring.a)]] -= block;
  }
}

struct Smallest {
  double value = std::numeric_limits<double>::infinity();
  std::uint32_t cell = 0, corner = 0;
  Smallest& operator+=(const Smallest& other) {
    if (other.value < value) *this = other;
    return *this;
  }
};

SmallestJacobian found(const Smallest& smallest) {
  if (!(smallest.value < std::numeric_limits<double>::infinity())) return {};
  return {smallest.value, smallest.cell, smallest.corner};
}

}  // namespace

std::vector<std::uint8_t> sound_cells(const Problem& problem) {
  std::vector<std::uint8_t> active(problem.body.cell_count(), 1);
  for (std::size_t c = 0; c < active.size(); ++c)
    active[c] = !(problem.body.broken.size() > c && problem.body.broken[c]) &&
                !(problem.stray_cell.size() > c && problem.stray_cell[c]);
  return active;
}

std::vector<std::uint8_t> active_cells(const Problem& problem) {
  std::vector<std::uint8_t> active = sound_cells(problem);
  for (std::size_t p = 0; p < problem.rigidity.size(); ++p)
    if (problem.rigidity[p] != Rigidity::none)
      std::fill(active.begin() + problem.body.parts[p].cell_begin,
                active.begin() + problem.body.parts[p].cell_end, std::uint8_t{0});
  return active;
}

Cells::Cells(const Problem& problem, const Stencil& stencil)
    : body_(problem.body),
      stencil_(stencil),
      active_(active_cells(problem)),
      part_(cell_parts(problem.body)),
      rest_shapes_(problem.body),
      share_(stiffness_shares(problem.body)) {
  for (std::size_t p = 0; p < body_.parts.size(); ++p)
    kinds_.push_back(cell_kind(body_.parts[p].lattice, problem.materials[p]));
  springs_.resize(body_.parts.size());
  for (std::size_t p = 0; p < problem.models.size(); ++p)
    if (problem.models[p] == Model::springs)
      springs_[p] = spring_kind(body_.parts[p].lattice, problem.materials[p]);
}

CellVectors Cells::corner_values(std::uint32_t cell, const std::vector<Vec3>& values) const {
  CellVectors u;
  for (std::size_t a = 0; a < 8; ++a) u[a] = values[body_.cell_elements[cell][a]];
  return u;
}

std::optional<CellKind> Cells::own_kind(std::uint32_t cell, const State& state) const {
  if (!rest_shapes_.any()) return std::nullopt;
  return rest_shapes_.of(kinds_[part_[cell]], body_.parts[part_[cell]], cell, grows_ ? state.share : 1);
}

template <class Visit>
auto Cells::with_kind(std::uint32_t cell, const State& state, const Visit& visit) const {
  const std::uint32_t part = part_[cell];
  if (const std::optional<SpringKind>& springs = springs_[part]) {
    if (const auto own = rest_shapes_.any() ? rest_shapes_.of(*springs, cell) : std::nullopt)
      return visit(*own);
    return visit(*springs);
  }
  if (const auto own = own_kind(cell, state)) return visit(*own);
  return visit(kinds_[part]);
}

bool Cells::may_fold(std::uint32_t cell, const CellVectors& u) const {
  return !springs_[part_[cell]] && !far_from_folding(kinds_[part_[cell]], u);
}

CornerThresholds Cells::thresholds(std::uint32_t cell, const State& state) const {
  return fold_thresholds(kinds_[part_[cell]], own_kind(cell, state));
}

double Cells::energy(const State& state) const {
  return parallel_sum<double>(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c]) return 0.0;
        const auto cell = static_cast<std::uint32_t>(c);
        const CellVectors u = corner_values(cell, state.displacement);
        // Springs alone would let a cell turn inside out and stay so.
        if (springs_[part_[c]] && !(volume_change(displacement_gradient(kinds_[part_[c]], u)) > -1))
          return std::numeric_limits<double>::infinity();
        double energy = with_kind(cell, state, [&](const auto& kind) { return cell_energy(kind, u); });
        if (may_fold(cell, u)) energy += fold_energy(kinds_[part_[c]], thresholds(cell, state), u);
        return share_[c] * energy;
      },
      kCellGrain);
}

void Cells::add_forces(const State& state, std::vector<Vec3>& forces) {
  corner_force_.resize(body_.cell_count());
  parallel_for_each(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c]) return;
        const auto cell = static_cast<std::uint32_t>(c);
        const CellVectors u = corner_values(cell, state.displacement);
        corner_force_[c] = with_kind(cell, state, [&](const auto& kind) { return cell_forces(kind, u); });
        if (may_fold(cell, u))
          add_fold_forces(kinds_[part_[c]], thresholds(cell, state), u, corner_force_[c]);
        for (Vec3& force : corner_force_[c]) force *= share_[c];
      },
      kCellGrain);
  parallel_for_each(body_.element_count(), [&](std::size_t e) {
    for (const Incidence& at : stencil_.of(static_cast<std::uint32_t>(e)))
      forces[e] += corner_force_[at.cell][at.corner];
  });
}

void Cells::set_stiffness(const State& state, const TangentOptions& tangent, BlockMatrix& matrix) {
  std::vector<PreparedCell> prepared(body_.cell_count());
  parallel_for_each(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c] || springs_[part_[c]]) return;
        const auto cell = static_cast<std::uint32_t>(c);
        const CellVectors u = corner_values(cell, state.displacement);
        with_kind(cell, state, [&](const auto& kind) {
          if constexpr (std::is_same_v<std::decay_t<decltype(kind)>, CellKind>)
            prepared[c] =
                prepare_cell(kind, u, tangent.project, tangent.stress ? &(*tangent.stress)[c] : nullptr);
        });
        if (!may_fold(cell, u)) return;
        if (const auto folding = fold_tangent(kinds_[part_[c]], thresholds(cell, state), u, tangent.project))
          prepared[c].folding = std::make_unique<FoldTangent>(*folding);
      },
      kCellGrain);
  parallel_for_each(
      body_.element_count(),
      [&](std::size_t e) {
        Block* row = matrix.values.data() + matrix.row_offsets[e];
        std::fill(row, matrix.values.data() + matrix.row_offsets[e + 1], Block::Zero());
        for (const Incidence& at : stencil_.of(static_cast<std::uint32_t>(e)))
          with_kind(at.cell, state, [&](const auto& kind) {
            if constexpr (std::is_same_v<std::decay_t<decltype(kind)>, CellKind>)
              add_cell_row(kind, prepared[at.cell], share_[at.cell], at.corner, stencil_.slot[at.cell], row);
            else
              add_spring_row(kind, corner_values(at.cell, state.displacement), share_[at.cell], at.corner,
                             tangent.project, stencil_.slot[at.cell], row);
          });
      },
      kCellGrain);
}

std::vector<Mat3> Cells::predicted_stress(const State& state, const std::vector<Vec3>& step) const {
  std::vector<Mat3> stress(body_.cell_count(), Mat3::Zero());
  parallel_for_each(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c] || springs_[part_[c]]) return;
        const auto cell = static_cast<std::uint32_t>(c);
        with_kind(cell, state, [&](const auto& kind) {
          if constexpr (std::is_same_v<std::decay_t<decltype(kind)>, CellKind>)
            stress[c] = simulate::predicted_stress(
                kind, displacement_gradient(kind, corner_values(cell, state.displacement)),
                displacement_gradient(kind, corner_values(cell, step)) - kind.offset);
        });
      },
      kCellGrain);
  return stress;
}

SmallestJacobian Cells::smallest_jacobian(const State& state) const {
  const Smallest smallest = parallel_sum<Smallest>(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c]) return Smallest{};
        const auto cell = static_cast<std::uint32_t>(c);
        const double value = 1 + volume_change(displacement_gradient(
                                     kinds_[part_[c]], corner_values(cell, state.displacement)));
        // one that is not a number must win
        return Smallest{std::isnan(value) ? -std::numeric_limits<double>::infinity() : value, cell};
      },
      kCellGrain);
  return found(smallest);
}

SmallestJacobian Cells::smallest_corner_jacobian(const State& state) const {
  const Smallest smallest = parallel_sum<Smallest>(
      body_.cell_count(),
      [&](std::size_t c) {
        Smallest least;
        if (!active_[c]) return least;
        const auto cell = static_cast<std::uint32_t>(c);
        const CellVectors u = corner_values(cell, state.displacement);
        for (std::uint32_t a = 0; a < 8; ++a)
          least += Smallest{1 + volume_change(corner_gradient(kinds_[part_[c]], u, a)), cell, a};
        return least;
      },
      kCellGrain);
  return found(smallest);
}

DrawnChains Cells::drawn_chains(const State& state) const {
  const auto has_chains = [](const CellKind& kind) { return kind.law.name == LawName::arruda_boyce; };
  if (std::none_of(kinds_.begin(), kinds_.end(), has_chains)) return {};
  const Smallest least = parallel_sum<Smallest>(
      body_.cell_count(),
      [&](std::size_t c) {
        const CellKind& kind = kinds_[part_[c]];
        if (!active_[c] || !has_chains(kind)) return Smallest{};
        const auto cell = static_cast<std::uint32_t>(c);
        const Mat3 h = displacement_gradient(kind, corner_values(cell, state.displacement));
        return Smallest{chain_reserve(kind.law, h), cell};
      },
      kCellGrain);
  if (!(least.value <= 1)) return {};
  return {std::sqrt(1 - least.value), least.cell};
}

std::string said_of_chains(const DrawnChains& drawn, const Body& body) {
  constexpr double kNearTheirEnd = 0.9;
  if (!(drawn.share > kNearTheirEnd)) return "";
  const std::uint32_t element = body.cell_elements[drawn.cell][0];
  const Vec3& at = body.rest[element];
  return fmt::format(
      "; near ({}, {}, {}) of part \"{}\" the chains of its law are drawn to {:.3g} % of their "
      "length, where they end (lambda_m)",
      human_length(at.x()), human_length(at.y()), human_length(at.z()),
      body.parts[element_parts(body)[element]].name, 100 * drawn.share);
}

}  // namespace flexel::simulate
