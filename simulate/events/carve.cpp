// Rows of every array of the body are kept or dropped, and what refers to them is renumbered. The surface
// stays as it is: its polygons over matter that is gone bound no cell from then on, and the column "carved"
// of its polygons says so, for the mapping to tell.
#include "simulate/events/carve.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "formats/lattice/body_moments.h"
#include "simulate/models/connections.h"

namespace flexel::simulate {
namespace {

constexpr std::uint32_t kGone = 0xffffffff;

std::vector<std::uint32_t> new_numbers(const std::vector<std::uint8_t>& keep) {
  std::vector<std::uint32_t> number(keep.size(), kGone);
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < keep.size(); ++i)
    if (keep[i]) number[i] = next++;
  return number;
}

template <class T>
void keep_rows(std::vector<T>& rows, const std::vector<std::uint8_t>& keep, std::size_t width = 1) {
  if (rows.empty()) return;
  std::size_t to = 0;
  for (std::size_t i = 0; i < keep.size(); ++i)
    if (keep[i])
      for (std::size_t k = 0; k < width; ++k) rows[to++] = rows[width * i + k];
  rows.resize(to);
}

void keep_rows(Columns& columns, const std::vector<std::uint8_t>& keep) {
  for (auto& [name, column] : columns)
    keep_rows(column.values, keep, static_cast<std::size_t>(column.components));
}

// Elements that are left: of corner-placed parts those of a cell that is, of others those outside.
std::vector<std::uint8_t> elements_left(const Body& body, const Chosen& chosen,
                                        const std::vector<std::uint8_t>& cells) {
  std::vector<std::uint8_t> keep(body.element_count(), 0);
  for (const Part& part : body.parts)
    if (part.placement == Placement::centre)
      for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) keep[e] = !chosen.elements[e];
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (cells[c])
      for (const std::uint32_t e : body.cell_elements[c]) keep[e] = 1;
  return keep;
}

void renumber_range(std::uint32_t& begin, std::uint32_t& end, const std::vector<std::uint8_t>& keep,
                    std::uint32_t& next) {
  const std::uint32_t first = next;
  for (std::uint32_t i = begin; i < end; ++i) next += keep[i];
  begin = first;
  end = next;
}

// Gives the number of polygons that lie over nothing now.
std::size_t renumber_surface(Body& body, const std::vector<std::uint32_t>& cell) {
  if (body.surface_cell_offsets.empty()) return 0;
  const std::size_t polygons = body.surface.polygon_count();
  Column& carved = body.surface.polygon_columns["carved"];
  if (carved.components != 1 || carved.values.size() != polygons)
    carved = {1, std::vector<double>(polygons, 0)};
  std::vector<std::uint32_t> left;
  std::uint32_t begin = 0;
  for (std::size_t p = 0; p < polygons; ++p) {
    const std::uint32_t end = body.surface_cell_offsets[p + 1];
    const std::size_t before = left.size();
    for (std::uint32_t i = begin; i < end; ++i)
      if (const std::uint32_t to = cell[body.surface_cells[i]]; to != kGone) left.push_back(to);
    if (left.size() == before && end > begin) carved.values[p] = 1;
    begin = end;
    body.surface_cell_offsets[p + 1] = static_cast<std::uint32_t>(left.size());
  }
  body.surface_cells = std::move(left);
  return static_cast<std::size_t>(std::count(carved.values.begin(), carved.values.end(), 1));
}

// For the mapping, which closes the surface around them: the voxels that go, in the note "carved".
void note_voxels(Body& body, const std::vector<std::uint8_t>& elements,
                 const std::vector<std::uint8_t>& cells) {
  std::string& note = body.notes["carved"];
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const auto add = [&](std::uint32_t element) {
      const Index3& index = body.lattice_index[element];
      note += fmt::format("{} {} {} {}\n", p, index[0], index[1], index[2]);
    };
    if (part.placement == Placement::centre)
      for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
        if (!elements[e]) add(e);
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      if (!cells[c]) add(body.cell_elements[c][0]);
  }
  if (note.empty()) body.notes.erase("carved");
}

void cut_connections(Body& body, const Problem& problem, const std::vector<std::uint8_t>& keep) {
  const Connections connections = make_connections(problem);
  for (std::size_t c = 0; c < connections.size(); ++c)
    if (!keep[connections.a[c]] || !keep[connections.b[c]])
      body.connections[connections.a[c]] &= ~(1u << (connections.kind[c] - 1));
}

bool takes_nothing(const std::vector<std::uint8_t>& keep) {
  return std::find(keep.begin(), keep.end(), 0) == keep.end();
}

void renumber_fused(std::vector<FusedPoint>& fused, const std::vector<std::uint32_t>& element) {
  std::erase_if(fused, [&](FusedPoint& point) {
    for (std::uint32_t& e : point.elements)
      if ((e = element[e]) == kGone) return true;
    return false;
  });
}

}  // namespace

Carve Carve::parse(TableReader& reader) {
  Carve made;
  made.origin_ = reader.place();
  (void)reader.require("where", "{ sphere = { centre = [\"0 mm\", 0, 0], radius = \"5 mm\" } }");
  made.region_ = parse_region(reader);
  return made;
}

std::string Carve::apply(EventContext& context) const {
  Body& body = context.body;
  const Chosen chosen = choose(region_, body, context.state);
  std::vector<std::uint8_t> cells = chosen.cells;
  for (std::uint8_t& cell : cells) cell = !cell;
  const std::vector<std::uint8_t> elements = elements_left(body, chosen, cells);
  if (takes_nothing(cells) && takes_nothing(elements))
    throw EmptySelectionError(
        origin_,
        fmt::format(
            "carve: no cell has more than half of its elements in {}: take a larger region, or smaller cells",
            describe(region_)));
  const std::size_t before = body.element_count() + body.cell_count();
  cut_connections(body, context.problem, elements);
  note_voxels(body, elements, cells);
  std::uint32_t next_element = 0, next_cell = 0;
  for (Part& part : body.parts) {
    renumber_range(part.element_begin, part.element_end, elements, next_element);
    renumber_range(part.cell_begin, part.cell_end, cells, next_cell);
    if (part.element_begin == part.element_end)
      throw InputError(origin_, fmt::format("carve leaves nothing of part \"{}\": take a smaller region, or "
                                            "leave the part out",
                                            part.name));
  }
  const std::vector<std::uint32_t> element = new_numbers(elements), cell = new_numbers(cells);
  keep_rows(body.lattice_index, elements);
  keep_rows(body.piece, elements);
  keep_rows(body.rest, elements);
  keep_rows(body.position, elements);
  keep_rows(body.connections, elements);
  keep_rows(body.element_columns, elements);
  keep_rows(body.cell_elements, cells);
  for (auto& corners : body.cell_elements)
    for (std::uint32_t& e : corners) e = element[e];
  renumber_moments(body, cell, kGone);
  keep_rows(body.fill, cells);
  keep_rows(body.broken, cells);
  keep_rows(body.cell_columns, cells);
  std::string bared;
  if (const std::size_t bare = renumber_surface(body, cell); bare > 0) {
    bared = fmt::format(
        "{} polygon(s) of the surface lie over nothing now (column \"carved\"): where a mapping puts them "
        "says nothing",
        bare);
    if (context.turns == 1) {
      context.progress.warn("carve: " + bared);
      bared.clear();
    } else {  // told once, with what was done last
      bared = "; " + bared;
    }
  }
  derive_connections(body);
  keep_rows(context.state.displacement, elements);
  keep_rows(context.state.velocity, elements);
  keep_rows(context.settled, elements);
  renumber_fused(context.fused, element);
  return fmt::format("{} of {} elements and cells taken away ({}){}",
                     before - body.element_count() - body.cell_count(), before, describe(region_), bared);
}

}  // namespace flexel::simulate
