// Regions of events.
#include "simulate/events/event.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"

namespace flexel::simulate {
namespace {

// A surface over nothing, as that of parts at centre placement, has polygons alone.
Chosen refuse_bare_surface(Chosen chosen, const Selection& where) {
  const auto any = [](const std::vector<std::uint8_t>& of) {
    return std::find(of.begin(), of.end(), 1) != of.end();
  };
  if (!any(chosen.elements) && !any(chosen.cells))
    throw InputError(where.origin,
                     fmt::format("{} has no elements and no cells that an event could change, surface "
                                 "only: give \"where\" a box, a sphere, a half-space or a part",
                                 describe(where)));
  return chosen;
}

}  // namespace

EventRegion parse_region(TableReader& reader) {
  EventRegion region;
  if (const SceneValue* where = reader.find("where")) region.where = parse_selection(*where, reader);
  if (const std::optional<std::string> positions = reader.text("positions")) {
    if (*positions != "now" && *positions != "rest")
      reader.fail(reader.find("positions")->line,
                  fmt::format("\"positions\" = \"{}\"; choose \"now\" or \"rest\"", *positions));
    region.at_rest = *positions == "rest";
  }
  return region;
}

std::string describe(const EventRegion& region) {
  return region.where ? describe(*region.where) : "everything";
}

Chosen choose(const EventRegion& region, const Body& body, const State& state) {
  if (!region.where)
    return {std::vector<std::uint8_t>(body.element_count(), 1),
            std::vector<std::uint8_t>(body.cell_count(), 1)};
  Chosen chosen{std::vector<std::uint8_t>(body.element_count(), 0),
                std::vector<std::uint8_t>(body.cell_count(), 0)};
  std::vector<Vec3> now(body.element_count());
  for (std::size_t e = 0; e < now.size(); ++e) now[e] = body.rest[e] + state.displacement[e];
  const Selected selected = resolve(*region.where, body, region.at_rest ? nullptr : &now);
  for (const std::uint32_t e : selected.elements) chosen.elements[e] = 1;
  for (std::size_t c = 0; c < chosen.cells.size(); ++c) {
    int inside = 0;
    for (const std::uint32_t e : body.cell_elements[c]) inside += chosen.elements[e];
    chosen.cells[c] = inside > 4;
  }
  if (body.surface_cell_offsets.empty()) return refuse_bare_surface(std::move(chosen), *region.where);
  for (const std::uint32_t polygon : selected.polygons)
    for (std::uint32_t i = body.surface_cell_offsets[polygon]; i < body.surface_cell_offsets[polygon + 1];
         ++i) {
      chosen.cells[body.surface_cells[i]] = 1;
      for (const std::uint32_t e : body.cell_elements[body.surface_cells[i]]) chosen.elements[e] = 1;
    }
  return refuse_bare_surface(std::move(chosen), *region.where);
}

}  // namespace flexel::simulate
