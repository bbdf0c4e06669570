// Tiles, chunks, blocks: sorted, so that neighbours along a row of the lattice fill a block wherever they
// can.
#include "simulate/kernels/chunk_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "simulate/kernels/connection_runs.h"
#include "simulate/models/cells.h"
#include "simulate/models/damping_factors.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

using step::CellBlock;
using step::kLanes;

constexpr Index3 kTile{32, 8, 8};
// Connections between the elements that chunks share are computed in each of them.
constexpr Index3 kConnectionTile{64, 8, 16};

step::CellConstants constants_of(const Part& part, const Material& material, double damping) {
  const CellKind kind = cell_kind_in_lattice(part.lattice, material);
  step::CellConstants c{};
  c.law = kind.law;
  for (std::size_t j = 0; j < 3; ++j) c.spacing[j] = part.lattice.spacing[static_cast<Eigen::Index>(j)];
  c.volume = kind.volume;
  c.mu = kind.mu;
  c.lambda = kind.lambda;
  const double per = 1 / (64 * kind.volume);
  for (std::size_t m = 0; m < 4; ++m) c.hourglass[m] = per * kind.hourglass[m];
  for (int j = 0; j < 3; ++j) {
    const int twists = 3 * j + (j + 2) % 3, k = 3 * j + (j + 1) % 3, l = 4 * ((j + 2) % 3);
    for (int other = 0; other < 3; ++other)
      c.twisting[j][other] = per * kind.by_mode(twists, 3 * other + (other + 2) % 3);
    c.bending[j][0] = per * kind.by_mode(k, k);
    c.bending[j][1] = per * kind.by_mode(k, l);
    c.bending[j][2] = per * kind.by_mode(l, l);
  }
  // corners 0 and 1 (edge), 3 (across a face), 7 (through the centre)
  for (const Spring& spring : spring_kind(part.lattice, material).springs)
    if (spring.a == 0 && (spring.b == 1 || spring.b == 3 || spring.b == 7))
      c.spring[spring.b == 1 ? 0 : spring.b == 3 ? 1 : 2] = spring.stiffness;
  for (std::size_t d = 0; d < half_neighbourhood.size(); ++d) {
    step::ConnectionKind& connection = c.connection[d];
    int axes = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      connection.rest[j] = half_neighbourhood[d][j] * c.spacing[j];
      connection.rest_square += connection.rest[j] * connection.rest[j];
      axes += half_neighbourhood[d][j] != 0;
    }
    connection.rest_length = std::sqrt(connection.rest_square);
    connection.stiffness = c.spring[axes - 1];
    connection.cells = 1 << (3 - axes);
  }
  c.damping = damping;
  for (Eigen::Index k = 0; k < 9; ++k) c.axes[k] = part.lattice.axes.data()[k];
  c.aligned = part.lattice.axes == Mat3::Identity();
  return c;
}

// Cells of a part that resist, in the body's order, by what edits made of them, as far as `plan` has it.
std::map<CellFactors, std::vector<std::uint32_t>> cells_by_factors(const Body& body, std::uint32_t part,
                                                                   const std::vector<std::uint8_t>& active,
                                                                   const KernelEffects& plan) {
  using Factors = std::vector<double>;
  const bool breaks = !plan.fracture.empty() && plan.fracture[part].any();
  const bool flows = !plan.plasticity.empty() && std::isfinite(plan.plasticity[part].yield);
  const Factors damping = plan.damping[part] > 0 ? damping_factors(body) : Factors();
  const Factors strength = breaks ? cell_factors(body, "strength_change") : Factors();
  const Factors yield = flows ? cell_factors(body, "yield_change") : Factors();
  const auto of = [](const Factors& factors, std::uint32_t c) { return factors.empty() ? 1 : factors[c]; };
  std::map<CellFactors, std::vector<std::uint32_t>> cells;
  for (std::uint32_t c = body.parts[part].cell_begin; c < body.parts[part].cell_end; ++c)
    if (active[c]) cells[{of(damping, c), of(strength, c), of(yield, c)}].push_back(c);
  return cells;
}

// Cells tile by tile; within a tile in the order given.
struct TiledCells {
  std::vector<std::uint32_t> cells;
  std::vector<std::size_t> tile_begin;  // and the end
};

TiledCells tiled_cells(const Body& body, const std::vector<std::uint32_t>& cells, const Index3& largest) {
  TiledCells result;
  result.cells = cells;
  const auto index = [&](std::uint32_t cell) { return body.lattice_index[body.cell_elements[cell][0]]; };
  Index3 low = index(result.cells[0]), high = low;
  for (const std::uint32_t c : result.cells)
    for (std::size_t j = 0; j < 3; ++j) {
      low[j] = std::min(low[j], index(c)[j]);
      high[j] = std::max(high[j], index(c)[j]);
    }
  Index3 size{};
  std::array<std::int64_t, 3> tiles{};
  for (std::size_t j = 0; j < 3; ++j) {
    const int extent = high[j] - low[j] + 1;
    tiles[j] = (extent + largest[j] - 1) / largest[j];
    size[j] = static_cast<int>((extent + tiles[j] - 1) / tiles[j]);  // even shares
  }
  size[0] = (size[0] + 7) / 8 * 8;  // whole blocks
  const auto tile = [&](std::uint32_t cell) {
    const Index3 at = index(cell);
    std::int64_t number = 0;
    for (std::size_t j = 3; j-- > 0;) number = number * tiles[j] + (at[j] - low[j]) / size[j];
    return number;
  };
  std::vector<std::pair<std::int64_t, std::uint32_t>> keyed;
  keyed.reserve(result.cells.size());
  for (const std::uint32_t c : result.cells) keyed.emplace_back(tile(c), c);
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    if (i == 0 || keyed[i].first != keyed[i - 1].first) result.tile_begin.push_back(i);
    result.cells[i] = keyed[i].second;
  }
  result.tile_begin.push_back(keyed.size());
  return result;
}

class LayoutBuilder {
 public:
  LayoutBuilder(const Problem& problem, bool remembers, StepLayout& layout)
      : body_(problem.body),
        remembers_(remembers),
        share_(stiffness_shares(problem.body)),
        layout_(layout),
        local_(problem.body.element_count()),
        users_(local_.size(), 0) {}

  // Cells of the kind that was added to the layout last.
  void add_chunk(std::span<const std::uint32_t> cells, bool by_connection);
  // Likewise those that share their lowest corner with another one of their chunk, which runs cannot tell
  // apart: where pieces branch.
  void add_left_over();
  void share();

 private:
  [[nodiscard]] std::vector<std::uint32_t> take_apart(std::span<const std::uint32_t> cells);
  void add_blocks(std::span<const std::uint32_t> cells);
  void add_block(std::span<const std::uint32_t> cells, bool is_run);
  void add_runs(std::span<const std::uint32_t> cells, std::size_t count);
  [[nodiscard]] bool continues(std::uint32_t cell, std::uint32_t next) const;

  const Body& body_;
  bool remembers_;
  std::vector<double> share_;  // (cells) of the stiffness of a whole cell
  StepLayout& layout_;
  std::vector<std::uint16_t> local_;  // (elements) number within the chunk that is built
  std::vector<std::uint8_t> users_;   // (elements) chunks that touch it, up to 2
  std::vector<std::uint32_t> left_over_;
  std::size_t corner_begin_ = 0;  // of the chunk that is built
};

void LayoutBuilder::add_block(std::span<const std::uint32_t> cells, bool is_run) {
  CellBlock block{};
  std::array<std::uint32_t, kLanes> lanes;
  lanes.fill(StepLayout::kNoCell);
  block.is_run = is_run;
  block.corners = static_cast<std::uint32_t>(layout_.corners.size() - corner_begin_);
  const std::size_t listed = is_run ? 1 : kLanes;
  layout_.corners.resize(layout_.corners.size() + 8 * listed);
  std::uint16_t* corners = layout_.corners.data() + corner_begin_ + block.corners;
  for (std::size_t l = 0; l < cells.size(); ++l) {
    lanes[l] = cells[l];
    block.fill[l] = share_[cells[l]];
    for (std::size_t a = 0; a < 8 && l < listed; ++a)
      corners[listed * a + l] = local_[body_.cell_elements[cells[l]][a]];
  }
  layout_.blocks.push_back(block);
  if (remembers_) layout_.block_cells.push_back(lanes);
}

// A block that is a run adds both faces of two neighbours at once: they have to share the elements between
// them, which cells numbered in a row beside a gap do not.
bool LayoutBuilder::continues(std::uint32_t cell, std::uint32_t next) const {
  const auto &here = body_.cell_elements[cell], &there = body_.cell_elements[next];
  for (std::size_t a = 0; a < 8; ++a)
    if (local_[there[a]] != local_[here[a]] + 1 || here[a | 1] != there[a & ~std::size_t{1}]) return false;
  return true;
}

void LayoutBuilder::add_blocks(std::span<const std::uint32_t> cells) {
  std::vector<std::uint32_t> rest;
  for (std::size_t i = 0; i < cells.size();) {
    std::size_t end = i + 1;
    while (end < cells.size() && end < i + kLanes && continues(cells[end - 1], cells[end])) ++end;
    if (end == i + kLanes) {
      add_block(cells.subspan(i, kLanes), true);
      i = end;
    } else {
      for (; i < end; ++i) rest.push_back(cells[i]);
    }
  }
  for (std::size_t i = 0; i < rest.size(); i += kLanes)
    add_block(std::span(rest).subspan(i, std::min(kLanes, rest.size() - i)), false);
}

void LayoutBuilder::add_runs(std::span<const std::uint32_t> cells, std::size_t count) {
  std::vector<std::array<std::uint16_t, 8>> corners(cells.size());
  std::vector<double> fill(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    fill[i] = share_[cells[i]];
    for (std::size_t a = 0; a < 8; ++a) corners[i][a] = local_[body_.cell_elements[cells[i]][a]];
  }
  const ConnectionRuns made = connection_runs(corners, fill, count);
  layout_.runs.insert(layout_.runs.end(), made.runs.begin(), made.runs.end());
  layout_.cell_fill.insert(layout_.cell_fill.end(), made.fill.begin(), made.fill.end());
}

void LayoutBuilder::add_chunk(std::span<const std::uint32_t> cells, bool by_connection) {
  StepLayout::Chunk chunk;
  chunk.kind = static_cast<std::uint32_t>(layout_.constants.size() - 1);
  chunk.part = layout_.kind_part[chunk.kind];
  chunk.block_begin = layout_.blocks.size();
  chunk.corner_begin = corner_begin_ = layout_.corners.size();
  chunk.run_begin = layout_.runs.size();
  chunk.fill_begin = layout_.cell_fill.size();
  chunk.element_begin = layout_.elements.size();
  std::vector<std::uint32_t> elements;
  elements.reserve(2 * cells.size());
  std::vector<std::uint32_t> apart;
  if (by_connection) {
    apart = take_apart(cells);
    cells = apart;
  }
  for (const std::uint32_t c : cells)
    elements.insert(elements.end(), body_.cell_elements[c].begin(), body_.cell_elements[c].end());
  std::sort(elements.begin(), elements.end());
  elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
  for (std::size_t l = 0; l < elements.size(); ++l) {
    local_[elements[l]] = static_cast<std::uint16_t>(l);
    users_[elements[l]] = static_cast<std::uint8_t>(std::min(2, users_[elements[l]] + 1));
  }
  if (by_connection) {
    add_runs(cells, elements.size());
  } else {
    add_blocks(cells);
  }
  layout_.elements.insert(layout_.elements.end(), elements.begin(), elements.end());
  layout_.largest_chunk = std::max(layout_.largest_chunk, elements.size());
  chunk.block_end = layout_.blocks.size();
  chunk.run_end = layout_.runs.size();
  chunk.element_end = layout_.elements.size();
  layout_.chunks.push_back(chunk);
}

// Cells with a lowest corner of their own; the others are left over.
std::vector<std::uint32_t> LayoutBuilder::take_apart(std::span<const std::uint32_t> cells) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> by_corner;  // lowest corner, cell
  by_corner.reserve(cells.size());
  for (const std::uint32_t c : cells) by_corner.emplace_back(body_.cell_elements[c][0], c);
  std::sort(by_corner.begin(), by_corner.end());
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < by_corner.size(); ++i) {
    const bool again = i > 0 && by_corner[i].first == by_corner[i - 1].first;
    (again ? left_over_ : kept).push_back(by_corner[i].second);
  }
  return kept;
}

void LayoutBuilder::add_left_over() {
  while (!left_over_.empty()) {
    const std::vector<std::uint32_t> cells = std::move(left_over_);
    left_over_.clear();
    for (std::size_t i = 0; i < cells.size(); i += StepLayout::kChunkCells)
      add_chunk(std::span(cells).subspan(i, std::min(StepLayout::kChunkCells, cells.size() - i)), true);
  }
}

// Once all chunks are there: who owns what.
void LayoutBuilder::share() {
  std::vector<std::uint32_t> place(users_.size(), 0);  // of a shared element in shared_elements
  for (std::uint32_t e = 0; e < users_.size(); ++e) {
    if (users_[e] == 0) layout_.lone_elements.push_back(e);
    if (users_[e] < 2) continue;
    place[e] = static_cast<std::uint32_t>(layout_.shared_elements.size());
    layout_.shared_elements.push_back(e);
  }
  std::vector<std::vector<std::uint32_t>> of(layout_.shared_elements.size());
  for (StepLayout::Chunk& chunk : layout_.chunks) {
    chunk.owned_begin = layout_.owned.size();
    chunk.shared_begin = layout_.shared.size();
    for (std::size_t i = chunk.element_begin; i < chunk.element_end; ++i) {
      const std::uint32_t e = layout_.elements[i];
      const auto l = static_cast<std::uint16_t>(i - chunk.element_begin);
      if (users_[e] < 2) {
        layout_.owned.push_back(l);
      } else {
        of[place[e]].push_back(static_cast<std::uint32_t>(layout_.shared.size()));
        layout_.shared.push_back(l);
      }
    }
    chunk.owned_end = layout_.owned.size();
    chunk.shared_end = layout_.shared.size();
  }
  layout_.slot_offsets.push_back(0);
  for (const std::vector<std::uint32_t>& slots : of) {
    layout_.slots.insert(layout_.slots.end(), slots.begin(), slots.end());
    layout_.slot_offsets.push_back(static_cast<std::uint32_t>(layout_.slots.size()));
  }
}

}  // namespace

std::size_t StepLayout::bytes() const {
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return of(chunks) + of(blocks) + of(corners) + of(block_cells) + of(runs) + of(cell_fill) + of(elements) +
         of(owned) + of(shared) + of(shared_elements) + of(slot_offsets) + of(slots) + of(lone_elements);
}

bool steps_by_connection(const Problem& problem, const KernelEffects& plan, std::size_t part) {
  return problem.models.size() > part && problem.models[part] == Model::springs && !plan.rest_shapes &&
         !plan.broken_springs && (plan.plasticity.empty() || !std::isfinite(plan.plasticity[part].yield)) &&
         (plan.fracture.empty() || !plan.fracture[part].any());
}

StepLayout step_layout(const Problem& problem, const KernelEffects& plan) {
  StepLayout layout;
  const Body& body = problem.body;
  const std::vector<std::uint8_t> active = active_cells(problem);
  LayoutBuilder builder(problem, plan.remembers(), layout);
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    const bool by_connection = steps_by_connection(problem, plan, p);
    for (const auto& [factors, cells] : cells_by_factors(body, p, active, plan)) {
      layout.constants.push_back(
          constants_of(body.parts[p], problem.materials[p], factors.damping * plan.damping[p]));
      layout.kind_part.push_back(p);
      layout.kind_factors.push_back(factors);
      const TiledCells tiled = tiled_cells(body, cells, by_connection ? kConnectionTile : kTile);
      for (std::size_t t = 0; t + 1 < tiled.tile_begin.size();) {
        const std::size_t begin = tiled.tile_begin[t];
        std::size_t end = tiled.tile_begin[++t];
        while (t + 1 < tiled.tile_begin.size() && tiled.tile_begin[t + 1] - begin <= StepLayout::kChunkCells)
          end = tiled.tile_begin[++t];
        builder.add_chunk(std::span(tiled.cells).subspan(begin, end - begin), by_connection);
      }
      builder.add_left_over();
    }
  }
  builder.share();
  layout.elements.shrink_to_fit();
  layout.blocks.shrink_to_fit();
  layout.corners.shrink_to_fit();
  layout.block_cells.shrink_to_fit();
  layout.runs.shrink_to_fit();
  layout.cell_fill.shrink_to_fit();
  layout.owned.shrink_to_fit();
  return layout;
}

}  // namespace flexel::simulate
