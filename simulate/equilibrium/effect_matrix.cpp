// Most effects do not say where they pull: all elements are moved, each its own way, and those with forces on them
// are the ones. Of one-sided forces that shows some, and they say it.
#include "simulate/equilibrium/effect_matrix.h"

#include <algorithm>
#include <numeric>

#include "simulate/linear/level.h"

namespace flexel::simulate {
namespace {

// Elements that the effects pull at when all are moved, each its own way.
std::vector<std::uint8_t> pulled_elements(const Body& body, const std::vector<ActiveEffect>& effects) {
  const std::size_t n = body.element_count();
  State state{std::vector<Vec3>(n), 1};
  for (std::size_t e = 0; e < n; ++e)
    for (std::size_t axis = 0; axis < 3; ++axis)
      state.displacement[e][static_cast<Eigen::Index>(axis)] = scattered(3 * e + axis);
  std::vector<Vec3> forces(n, Vec3::Zero());
  for (const ActiveEffect& effect : effects)
    if (effect->adds_stiffness() && !effect->tells_where_it_pulls()) effect->add_forces(state, forces);
  std::vector<std::uint8_t> pulled(n);
  for (std::size_t e = 0; e < n; ++e) pulled[e] = forces[e] != Vec3::Zero();
  return pulled;
}

// Those, and their neighbours: a tie of a cell may leave some of its corners alone.
std::vector<std::uint8_t> touched_elements(const Body& body, const BlockMatrix& pattern,
                                           const std::vector<ActiveEffect>& effects) {
  const std::vector<std::uint8_t> pulled = pulled_elements(body, effects);
  std::vector<std::uint8_t> touched(pulled.size(), 0);
  for (const ActiveEffect& effect : effects)
    for (const std::uint32_t e : effect->may_pull_at()) touched[e] = 1;
  for (std::size_t e = 0; e < pulled.size(); ++e)
    if (pulled[e])
      for (std::uint64_t q = pattern.row_offsets[e]; q < pattern.row_offsets[e + 1]; ++q)
        touched[pattern.columns[q]] = 1;
  return touched;
}

}  // namespace

BlockMatrix matrix_of_effects(const Body& body, const BlockMatrix& pattern,
                              const std::vector<ActiveEffect>& effects) {
  BlockMatrix matrix;
  matrix.row_offsets.assign(body.element_count() + 1, 0);
  const auto adds = [](const ActiveEffect& effect) { return effect->adds_stiffness(); };
  if (std::none_of(effects.begin(), effects.end(), adds)) return matrix;
  const std::vector<std::uint8_t> touched = touched_elements(body, pattern, effects);
  for (std::size_t e = 0; e < touched.size(); ++e) {
    if (touched[e])
      for (std::uint64_t q = pattern.row_offsets[e]; q < pattern.row_offsets[e + 1]; ++q)
        if (touched[pattern.columns[q]]) matrix.columns.push_back(pattern.columns[q]);
    matrix.row_offsets[e + 1] = matrix.columns.size();
  }
  matrix.values.assign(matrix.columns.size(), Block::Zero());
  return matrix;
}

BlockMatrix matrix_of_effects(const Body& body, const std::vector<std::uint8_t>& active,
                              const std::vector<ActiveEffect>& effects) {
  std::vector<std::uint8_t> pulled = pulled_elements(body, effects);
  for (const ActiveEffect& effect : effects)
    for (const std::uint32_t e : effect->may_pull_at()) pulled[e] = 1;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> blocks;
  for (std::uint32_t e = 0; e < pulled.size(); ++e)
    if (pulled[e]) blocks.emplace_back(e, e);
  for (std::size_t c = 0; c < active.size(); ++c) {
    const auto& corners = body.cell_elements[c];
    if (!active[c] || std::none_of(corners.begin(), corners.end(), [&](auto e) { return pulled[e]; }))
      continue;
    for (const std::uint32_t row : corners)
      for (const std::uint32_t column : corners) blocks.emplace_back(row, column);
  }
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  BlockMatrix matrix;
  matrix.row_offsets.assign(body.element_count() + 1, 0);
  for (const auto& [row, column] : blocks) {
    ++matrix.row_offsets[row + 1];
    matrix.columns.push_back(column);
  }
  std::partial_sum(matrix.row_offsets.begin(), matrix.row_offsets.end(), matrix.row_offsets.begin());
  matrix.values.assign(matrix.columns.size(), Block::Zero());
  return matrix;
}

}  // namespace flexel::simulate
