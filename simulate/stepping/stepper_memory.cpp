// What cells remember of flow and fracture: kept, restored, and carried in the columns of a body file.
#include <algorithm>
#include <cstring>

#include "simulate/stepping/stepper.h"

namespace flexel::simulate {
namespace {

// What is remembered as rows of lanes, with the column that holds it.
struct Remembered {
  const char* column;
  int components;
  std::size_t offset;  // of the first row in the block's memory [doubles]
};

constexpr std::size_t kRow = step::kLanes;
constexpr Remembered kOfCells[] = {
    {"plastic_flow", 6, 0}, {"plastic_strain", 1, 6 * kRow}, {"plastic_hourglass", 12, 7 * kRow}};
constexpr Remembered kRestVolume{"rest_volume", 1, 19 * kRow};
constexpr Remembered kOfSprings[] = {{"spring_flow", 28, 0}, {"spring_strain", 28, 28 * kRow}};
static_assert(sizeof(step::PlasticBlock) == 20 * kRow * sizeof(double));
static_assert(sizeof(step::SpringFlow) == 56 * kRow * sizeof(double));

// Calls visit(block, lane, cell) for every lane with a cell.
template <class Visit>
void for_each_lane(const StepLayout& layout, const Visit& visit) {
  for (std::size_t b = 0; b < layout.block_cells.size(); ++b)
    for (std::size_t l = 0; l < step::kLanes; ++l)
      if (layout.block_cells[b][l] != StepLayout::kNoCell) visit(b, l, layout.block_cells[b][l]);
}

template <class Block>
void write_rows(const StepLayout& layout, const std::vector<Block>& memory, const Remembered& what,
                std::size_t cells, Columns& columns) {
  if (memory.empty()) return;
  // Cells that are not stepped, broken ones, keep what they remember.
  Column& column = columns[what.column];
  const auto width = static_cast<std::size_t>(what.components);
  if (column.components != what.components || column.values.size() != width * cells)
    column = {what.components, std::vector<double>(width * cells, 0)};
  for_each_lane(layout, [&](std::size_t b, std::size_t l, std::uint32_t cell) {
    const auto* rows = reinterpret_cast<const double*>(&memory[b]) + what.offset;
    for (std::size_t i = 0; i < width; ++i) column.values[width * cell + i] = rows[kRow * i + l];
  });
}

template <class Block>
void read_rows(const StepLayout& layout, const Columns& columns, const Remembered& what,
               std::vector<Block>& memory) {
  const auto found = columns.find(what.column);
  if (memory.empty() || found == columns.end() || found->second.components != what.components) return;
  const auto width = static_cast<std::size_t>(what.components);
  for_each_lane(layout, [&](std::size_t b, std::size_t l, std::uint32_t cell) {
    auto* rows = reinterpret_cast<double*>(&memory[b]) + what.offset;
    for (std::size_t i = 0; i < width; ++i) rows[kRow * i + l] = found->second.values[width * cell + i];
  });
}

}  // namespace

Stepper::Memory Stepper::memory() const {
  Memory memory{{}, plastic_, springs_, spring_flow_};
  if (fractures_)
    for (const step::CellBlock& block : layout_.blocks) memory.fill.push_back(std::to_array(block.fill));
  return memory;
}

void Stepper::restore(const Memory& memory) {
  plastic_ = memory.plastic;
  springs_ = memory.springs;
  spring_flow_ = memory.spring_flow;
  for (std::size_t b = 0; b < memory.fill.size(); ++b)
    std::copy(memory.fill[b].begin(), memory.fill[b].end(), layout_.blocks[b].fill);
}

bool Stepper::mark_broken(std::vector<std::uint8_t>& broken) const {
  if (!fractures_) return false;
  bool found = false;
  for_each_lane(layout_, [&](std::size_t b, std::size_t l, std::uint32_t cell) {
    if (layout_.blocks[b].fill[l] > 0) return;
    broken[cell] = 1;
    found = true;
  });
  return found;
}

std::vector<double> Stepper::plastic_strain(std::size_t cells) const {
  std::vector<double> strain;
  if (plastic_.empty()) return strain;
  strain.assign(cells, 0);
  for (std::size_t b = 0; b < layout_.blocks.size(); ++b)
    for (std::size_t l = 0; l < step::kLanes; ++l)
      if (const std::uint32_t cell = layout_.block_cells[b][l]; cell != StepLayout::kNoCell)
        strain[cell] = plastic_[b].strain[l];
  return strain;
}

void Stepper::write_memory(std::size_t cells, Columns& columns) const {
  for (const Remembered& what : kOfCells) write_rows(layout_, plastic_, what, cells, columns);
  for (const Remembered& what : kOfSprings) write_rows(layout_, spring_flow_, what, cells, columns);
  if (columns.contains(kRestVolume.column)) write_rows(layout_, plastic_, kRestVolume, cells, columns);
  if (springs_.empty()) return;
  Column column;
  column.values.assign(cells, 0);
  for_each_lane(layout_, [&](std::size_t b, std::size_t l, std::uint32_t cell) {
    column.values[cell] = static_cast<double>(springs_[b].broken[l]);
  });
  columns["broken_springs"] = std::move(column);
}

void Stepper::read_memory(const Columns& columns) {
  for (const Remembered& what : kOfCells) read_rows(layout_, columns, what, plastic_);
  read_rows(layout_, columns, kRestVolume, plastic_);
  for (const Remembered& what : kOfSprings) read_rows(layout_, columns, what, spring_flow_);
  const auto found = columns.find("broken_springs");
  if (springs_.empty() || found == columns.end() || found->second.components != 1) return;
  for_each_lane(layout_, [&](std::size_t b, std::size_t l, std::uint32_t cell) {
    springs_[b].broken[l] = static_cast<std::uint64_t>(found->second.values[cell]) & step::kAllSprings;
  });
}

}  // namespace flexel::simulate
