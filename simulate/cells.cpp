// Cells over a body. Forces go in two passes without races: each cell writes the forces on its corners, then
// each element gathers those of its cells in ascending order. The stiffness is gathered too, row by row, so
// every sum has a fixed order and the bits do not depend on the number of threads.
#include "simulate/cells.h"

#include <limits>
#include <memory>

#include "formats/parallel.h"

namespace flexel {
namespace {

constexpr std::size_t kGrain = 512;

// What the rows need of a cell: its tangent, and where it is indefinite the projected moduli.
struct PreparedCell {
  CellTangent tangent;
  std::unique_ptr<Mat9> projected;
};

void add_cell_row(const CellKind& kind, const PreparedCell& cell, double fill, std::size_t a,
                  const std::array<std::uint8_t, 64>& slot, Block* row) {
  if (cell.projected) {
    for (std::size_t b = 0; b < 8; ++b)
      row[slot[8 * a + b]] += fill * projected_block(kind, *cell.projected, a, b);
    return;
  }
  const double scale = fill * kind.volume / 16;
  const Vec3 w_a = cell.tangent.inverse_transpose * kind.gradient[a];
  const Vec3 symmetric = (scale * kind.lambda) * w_a;
  const Vec3 swapped = (scale * (kind.mu - kind.lambda * cell.tangent.log_volume)) * w_a;
  for (std::size_t b = 0; b < 8; ++b) {
    const Vec3 w_b = cell.tangent.inverse_transpose * kind.gradient[b];
    Block& block = row[slot[8 * a + b]];
    block.noalias() += symmetric * w_b.transpose();
    block.noalias() += w_b * swapped.transpose();
    block.diagonal().array() += fill * kind.diagonal[8 * a + b];
  }
}

struct Smallest {
  double value = std::numeric_limits<double>::infinity();
  std::uint32_t cell = 0;
  Smallest& operator+=(const Smallest& other) {
    if (other.value < value) *this = other;
    return *this;
  }
};

}  // namespace

std::vector<std::uint8_t> active_cells(const Setting& setting) {
  std::vector<std::uint8_t> active(setting.body.cell_count(), 1);
  for (std::size_t c = 0; c < active.size(); ++c)
    active[c] = !(setting.body.broken.size() > c && setting.body.broken[c]) &&
                !(setting.stray_cell.size() > c && setting.stray_cell[c]);
  return active;
}

Cells::Cells(const Setting& setting, const Stencil& stencil)
    : body_(setting.body),
      stencil_(stencil),
      active_(active_cells(setting)),
      part_(cell_parts(setting.body)) {
  for (std::size_t p = 0; p < body_.parts.size(); ++p)
    kinds_.push_back(cell_kind(body_.parts[p].lattice, setting.materials[p]));
}

CellVectors Cells::displacement_of(std::uint32_t cell, const State& state) const {
  CellVectors u;
  for (std::size_t a = 0; a < 8; ++a) u[a] = state.displacement[body_.cell_elements[cell][a]];
  return u;
}

double Cells::energy(const State& state) const {
  return parallel_sum<double>(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c]) return 0.0;
        const auto cell = static_cast<std::uint32_t>(c);
        return body_.fill[c] * cell_energy(kinds_[part_[c]], displacement_of(cell, state));
      },
      kGrain);
}

void Cells::add_forces(const State& state, std::vector<Vec3>& forces) {
  corner_force_.resize(body_.cell_count());
  parallel_for_each(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c]) return;
        corner_force_[c] =
            cell_forces(kinds_[part_[c]], displacement_of(static_cast<std::uint32_t>(c), state));
        for (Vec3& force : corner_force_[c]) force *= body_.fill[c];
      },
      kGrain);
  parallel_for_each(body_.element_count(), [&](std::size_t e) {
    for (const Incidence& at : stencil_.of(static_cast<std::uint32_t>(e)))
      forces[e] += corner_force_[at.cell][at.corner];
  });
}

void Cells::set_stiffness(const State& state, bool project, BlockMatrix& matrix) {
  std::vector<PreparedCell> prepared(body_.cell_count());
  parallel_for_each(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c]) return;
        const CellKind& kind = kinds_[part_[c]];
        prepared[c].tangent =
            cell_tangent(displacement_gradient(kind, displacement_of(static_cast<std::uint32_t>(c), state)));
        if (project)
          prepared[c].projected = std::make_unique<Mat9>(projected_elasticity(kind, prepared[c].tangent));
      },
      kGrain);
  parallel_for_each(
      body_.element_count(),
      [&](std::size_t e) {
        Block* row = matrix.values.data() + matrix.row_offsets[e];
        std::fill(row, matrix.values.data() + matrix.row_offsets[e + 1], Block::Zero());
        for (const Incidence& at : stencil_.of(static_cast<std::uint32_t>(e)))
          add_cell_row(kinds_[part_[at.cell]], prepared[at.cell], body_.fill[at.cell], at.corner,
                       stencil_.slot[at.cell], row);
      },
      kGrain);
}

SmallestJacobian Cells::smallest_jacobian(const State& state) const {
  const Smallest smallest = parallel_sum<Smallest>(
      body_.cell_count(),
      [&](std::size_t c) {
        if (!active_[c]) return Smallest{};
        const auto cell = static_cast<std::uint32_t>(c);
        return Smallest{
            1 + volume_change(displacement_gradient(kinds_[part_[c]], displacement_of(cell, state))), cell};
      },
      kGrain);
  if (!(smallest.value < std::numeric_limits<double>::infinity())) return {};
  return {smallest.value, smallest.cell};
}

}  // namespace flexel
