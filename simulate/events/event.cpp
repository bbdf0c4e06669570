// Regions of events.
#include "simulate/events/event.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/math/rigid_fit.h"
#include "base/nearest_word.h"

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

bool is_shape(const Selection& selection) {
  switch (selection.kind) {
    case Selection::Kind::box:
    case Selection::Kind::sphere:
    case Selection::Kind::half_space:
      return true;
    case Selection::Kind::any_of:
      return std::all_of(selection.members.begin(), selection.members.end(), is_shape);
    default:
      return false;
  }
}

// Of shapes, some of which may hold nothing.
std::vector<std::uint32_t> in_shapes(const Selection& shapes, const Body& body, const std::vector<Vec3>& at) {
  if (shapes.kind != Selection::Kind::any_of) return resolve(shapes, body, &at).elements;
  std::vector<std::uint32_t> all;
  std::optional<EmptySelectionError> empty;
  for (const Selection& member : shapes.members) try {
      const std::vector<std::uint32_t> one = in_shapes(member, body, at);
      all.insert(all.end(), one.begin(), one.end());
    } catch (const EmptySelectionError& error) {
      empty = error;
    }
  if (all.empty() && empty) throw EmptySelectionError(*empty);
  return all;
}

// Where matter is now. One of a list or of "not" that holds nothing is a mistake, though the event may have found something
// else.
Selected present_selection(const Selection& where, const Body& body, const std::vector<Vec3>* at) {
  try {
    return resolve(where, body, at);
  } catch (const EmptySelectionError& error) {
    if (where.kind != Selection::Kind::any_of && where.kind != Selection::Kind::complement) throw;
    throw InputError(
        error.where(),
        fmt::format("{}; of a list, or under \"not\", each needs to hold something: an [[event]] "
                    "with \"every\" for each alone may find nothing",
                    error.what()));
  }
}

// The elements in shapes that move with a part, without its own.
Selected carried_selection(const EventRegion& region, const Body& body, const State& state,
                           std::vector<Vec3> at) {
  const auto part = std::find_if(body.parts.begin(), body.parts.end(),
                                 [&](const Part& each) { return each.name == region.with; });
  if (part == body.parts.end()) {
    std::vector<std::string> names;
    for (const Part& each : body.parts) names.push_back(each.name);
    throw InputError(region.origin, fmt::format("with = \"{}\": no part is called that{}", region.with,
                                                did_you_mean(region.with, names)));
  }
  const auto range = [&](const std::vector<Vec3>& of) {
    return std::vector<Vec3>(of.begin() + part->element_begin, of.begin() + part->element_end);
  };
  const RigidFit motion = rigid_fit(range(body.rest), range(state.displacement));
  for (Vec3& each : at) each = motion.before(each);
  Selected selected;
  for (const std::uint32_t e : in_shapes(*region.where, body, at))
    if (e < part->element_begin || e >= part->element_end) selected.elements.push_back(e);
  if (selected.elements.empty())
    throw EmptySelectionError(region.origin,
                              fmt::format("the {} that moves with \"{}\" holds nothing of other parts",
                                          describe(*region.where), region.with));
  return selected;
}

}  // namespace

EventRegion parse_region(TableReader& reader) {
  EventRegion region;
  region.origin = reader.place();
  if (const SceneValue* where = reader.find("where")) region.where = parse_selection(*where, reader);
  if (const std::optional<std::string> positions = reader.text("positions")) {
    if (*positions != "now" && *positions != "rest")
      reader.fail(reader.find("positions")->line,
                  fmt::format("\"positions\" = \"{}\"; choose \"now\" or \"rest\"", *positions));
    region.at_rest = *positions == "rest";
  }
  region.with = reader.text("with").value_or("");
  if (!region.with.empty() && (region.at_rest || !region.where || !is_shape(*region.where)))
    reader.fail(reader.find("with")->line,
                "\"with\" moves a box, a sphere or a half-space of \"where\" with a part, as { sphere = { "
                "centre = [\"0 mm\", 0, 0], "
                "radius = \"5 mm\" } }, and looks for elements where they are now");
  return region;
}

std::string describe(const EventRegion& region) {
  const std::string where = region.where ? describe(*region.where) : "everything";
  return region.with.empty() ? where : fmt::format("{} with \"{}\"", where, region.with);
}

Chosen choose(const EventRegion& region, const Body& body, const State& state) {
  if (!region.where)
    return {std::vector<std::uint8_t>(body.element_count(), 1),
            std::vector<std::uint8_t>(body.cell_count(), 1)};
  Chosen chosen{std::vector<std::uint8_t>(body.element_count(), 0),
                std::vector<std::uint8_t>(body.cell_count(), 0)};
  std::vector<Vec3> now(body.element_count());
  for (std::size_t e = 0; e < now.size(); ++e) now[e] = body.rest[e] + state.displacement[e];
  const Selected selected = region.with.empty()
                                ? present_selection(*region.where, body, region.at_rest ? nullptr : &now)
                                : carried_selection(region, body, state, std::move(now));
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
