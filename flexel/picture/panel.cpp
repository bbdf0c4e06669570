// From a subject to drawables: positions, values, outline at rest.
#include "flexel/picture/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "flexel/picture/lattice_drawable.h"
#include "flexel/picture/render/quantity.h"
#include "flexel/picture/render/thickness.h"
#include "mapping/map_refined.h"
#include "mapping/methods/map_surface.h"
#include "mapping/methods/method.h"

namespace flexel::picture {
namespace {

// The centre and half diagonal of everything drawn.
DrawingFrame frame_of(const std::vector<Vec3>& positions, const std::vector<Vec3>* rest) {
  Box box = bounding_box(positions);
  if (rest != nullptr)
    for (const Vec3& point : *rest) box.add(point);
  const double radius = box.diagonal() / 2;
  return {(box.min + box.max) / 2, radius > 0 ? radius : 1};
}

// Rest positions, and where the points are drawn.
struct Positions {
  std::vector<Vec3> rest, moved;
  bool deformed = false;
};

Positions move(std::vector<Vec3> rest, const std::vector<Vec3>& displacement, const PictureOptions& options,
               Panel& panel) {
  Positions positions;
  for (const Vec3& u : displacement) {
    panel.motion += u * u.transpose();
    panel.largest_displacement = std::max(panel.largest_displacement, u.norm());
  }
  panel.diagonal = bounding_box(rest).diagonal();
  positions.deformed = panel.largest_displacement > 0;
  const double factor = options.exaggeration.value_or(1);
  positions.moved = rest;
  if (positions.deformed)
    parallel_for_each(rest.size(), [&](std::size_t i) { positions.moved[i] += factor * displacement[i]; });
  const Vec3 size = bounding_box(positions.moved).size();
  if (!size.allFinite() || size.maxCoeff() > kLargestCoordinate)
    throw InputError(panel.subject->where,
                     fmt::format("--scale {:g} takes its deformation beyond all measure", factor));
  positions.rest = std::move(rest);
  return positions;
}

// Vertices that no polygon uses are put where they do not stretch the frame.
void pull_in_unused(const Surface& surface, std::vector<Vec3>& points) {
  std::vector<std::uint8_t> used(points.size(), 0);
  for (const std::uint32_t v : surface.polygon_vertices) used[v] = 1;
  for (std::size_t v = 0; v < points.size(); ++v)
    if (used[v] == 0) points[v] = points[surface.polygon_vertices.front()];
}

void set_values(Drawable& drawn, Drawable::ValuesAt at, const std::vector<double>& values) {
  drawn.values_at = at;
  drawn.values.resize(values.size());
  parallel_for_each(values.size(), [&](std::size_t i) { drawn.values[i] = static_cast<float>(values[i]); });
}

std::vector<double> per_triangle(const std::vector<double>& values, const std::vector<std::uint32_t>& owner) {
  std::vector<double> result(owner.size());
  parallel_for_each(owner.size(), [&](std::size_t t) { result[t] = values[owner[t]]; });
  return result;
}

// The file's own colours.
void set_own_colours(const Surface& surface, const MeshTopology& mesh, Drawable& drawn) {
  const auto rgb = [](const Column& column, std::size_t i) {
    return Eigen::Map<const Vec3>(column.values.data() + i * static_cast<std::size_t>(column.components))
        .cast<float>();
  };
  if (const auto at = surface.vertex_columns.find(kColorColumn); at != surface.vertex_columns.end()) {
    drawn.colours_at = Drawable::ValuesAt::vertices;
    drawn.colours.resize(surface.vertices.size());
    parallel_for_each(drawn.colours.size(), [&](std::size_t v) { drawn.colours[v] = rgb(at->second, v); });
  } else if (const auto of = surface.polygon_columns.find(kColorColumn);
             of != surface.polygon_columns.end()) {
    drawn.colours_at = Drawable::ValuesAt::primitives;
    drawn.colours.resize(drawn.triangles.size());
    parallel_for_each(drawn.colours.size(),
                      [&](std::size_t t) { drawn.colours[t] = rgb(of->second, mesh.triangles.polygon[t]); });
  }
}

void set_surface_values(const Surface& surface, const MeshTopology& mesh, const std::string& name,
                        Drawable& drawn) {
  const std::optional<Attribute> attribute = surface_attribute(surface, name);
  if (!attribute) return;
  if (attribute->at == Attribute::At::vertices)
    set_values(drawn, Drawable::ValuesAt::vertices, attribute->values);
  else
    set_values(drawn, Drawable::ValuesAt::primitives,
               per_triangle(attribute->values, mesh.triangles.polygon));
}

void draw_mapped(const Body& body, const mapping::MapResult& mapped, const PictureOptions& options,
                 const ColourBy& by, Panel& panel) {
  const Surface& surface = body.surface;
  for (const Vec3& u : mapped.displacement)
    if (!u.allFinite())
      throw InputError(panel.subject->where,
                       "its surface cannot be drawn: the mapping gives positions that are not finite; "
                       "--cells draws the lattice");
  Positions positions = move(surface.vertices, mapped.displacement, options, panel);
  pull_in_unused(surface, positions.rest);
  pull_in_unused(surface, positions.moved);
  const bool with_rest = options.outline_at_rest && positions.deformed;
  panel.frame = frame_of(positions.moved, with_rest ? &positions.rest : nullptr);
  const MeshTopology mesh = mesh_topology(surface);
  panel.drawn = draw_surface(surface, mesh, positions.moved, panel.frame);
  if (with_rest) panel.rest = draw_surface(surface, mesh, positions.rest, panel.frame);
  set_own_colours(surface, mesh, panel.drawn);
  if (by.name.empty() || by.by_rays) return;
  if (const auto [column, component] = split_name(by.name); column == "displacement")
    if (const auto values = displacement_values(mapped.displacement, component))
      return set_values(panel.drawn, Drawable::ValuesAt::vertices, *values);
  const std::optional<Attribute> attribute = body_attribute(body, by.name);
  if (!attribute) return set_surface_values(surface, mesh, by.name, panel.drawn);
  std::vector<std::uint32_t> nearest(mapped.frame.size());
  for (std::size_t v = 0; v < nearest.size(); ++v) nearest[v] = mapped.frame_of(v).elements[0];
  set_values(panel.drawn, Drawable::ValuesAt::vertices, at_vertices(body, *attribute, nearest));
}

// Split where its triangles would hide the bend, as the part is when it is written.
void draw_body_surface(const Body& body, const PictureOptions& options, const ColourBy& by,
                       Progress& progress, Panel& panel) {
  mapping::MapOptions how;
  how.method = mapping::default_method(body);
  constexpr double kFirst = 0.4, kLooked = 0.6;  // of the time
  const mapping::MapResult mapped = [&] {
    const ShareScope first(progress, 0, kFirst);
    return map_surface(body, how, progress);
  }();
  const std::optional<Body> split = [&] {
    const ShareScope looking(progress, kFirst, kLooked);
    return split_where_coarse(body, mapped, progress);
  }();
  if (split) {
    const ShareScope second(progress, kLooked, 1);
    return draw_mapped(*split, map_surface(*split, how, progress), options, by, panel);
  }
  draw_mapped(body, mapped, options, by, panel);
}

void draw_lattice(const Body& body, const PictureOptions& options, const ColourBy& by, Panel& panel) {
  std::vector<Vec3> displacement(body.element_count());
  for (std::size_t e = 0; e < displacement.size(); ++e) displacement[e] = body.position[e] - body.rest[e];
  const Positions positions = move(body.rest, displacement, options, panel);
  panel.frame = frame_of(positions.moved, nullptr);
  const bool valued = !by.name.empty() && !by.by_rays;
  const std::optional<Attribute> attribute = valued ? body_attribute(body, by.name) : std::nullopt;
  if (options.show == PictureOptions::Show::elements) {
    panel.drawn = draw_elements(body, positions.moved, panel.frame);
    if (attribute) set_values(panel.drawn, Drawable::ValuesAt::primitives, at_elements(body, *attribute));
    return;
  }
  if (body.cell_count() == 0)
    throw InputError(panel.subject->where, "has no cells (placement centre): --elements draws its elements");
  CellHull hull = draw_cells(body, positions.moved, panel.frame);
  panel.drawn = std::move(hull.drawn);
  if (!attribute) return;
  if (attribute->at == Attribute::At::cells)
    set_values(panel.drawn, Drawable::ValuesAt::primitives, per_triangle(attribute->values, hull.cell));
  else
    set_values(panel.drawn, Drawable::ValuesAt::vertices, attribute->values);
}

void draw_surface_file(const Surface& surface, const PictureOptions& options, const ColourBy& by,
                       Panel& panel) {
  if (options.show != PictureOptions::Show::surface)
    throw InputError(panel.subject->where,
                     "is a surface and has no cells or elements: --cells and --elements need a body (.vtu)");
  std::vector<Vec3> points = surface.vertices;
  pull_in_unused(surface, points);
  panel.diagonal = bounding_box(points).diagonal();
  panel.frame = frame_of(points, nullptr);
  const MeshTopology mesh = mesh_topology(surface);
  panel.drawn = draw_surface(surface, mesh, points, panel.frame);
  set_own_colours(surface, mesh, panel.drawn);
  if (!by.name.empty() && !by.by_rays) set_surface_values(surface, mesh, by.name, panel.drawn);
}

void find_range(const ColourBy& by, Panel& panel) {
  if (by.by_rays) {
    const ThicknessRange range = thickness_range(panel.drawn, *panel.tracer);
    if (!(range.high > 0)) return;
    panel.largest = range.largest * static_cast<float>(panel.frame.radius);
    panel.low = range.low * static_cast<float>(panel.frame.radius);
    panel.high = range.high * static_cast<float>(panel.frame.radius);
    return;
  }
  for (const float value : panel.drawn.values) {
    if (!std::isfinite(value)) continue;
    panel.low = std::min(panel.low.value_or(value), value);
    panel.high = std::max(panel.high.value_or(value), value);
  }
  // Vertices are samples, and elements beside the part carry it without being of it: the largest is that of
  // its matter.
  if (!panel.subject->body || !panel.high) return;
  if (const auto largest = largest_in_matter(*panel.subject->body, by.name))
    panel.high = static_cast<float>(*largest);
}

}  // namespace

double fitting_exaggeration(const Body& body) {
  double largest = 0;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    largest = std::max(largest, (body.position[e] - body.rest[e]).norm());
  const double factor = 0.1 * bounding_box(body.rest).diagonal() / largest;
  return std::isfinite(factor) && factor > 1 ? round_below(factor) : 1;
}

Panel make_panel(const PictureSubject& subject, const PictureOptions& options, const ColourBy& by,
                 Progress& progress) {
  Panel panel;
  panel.subject = &subject;
  constexpr double kPlaced = 0.4, kTraced = 0.7, kTracedAtRest = 0.9;  // of the time
  if (!subject.body) {
    draw_surface_file(subject.surface, options, by, panel);
  } else if (options.show == PictureOptions::Show::surface) {
    if (subject.body->surface.polygon_count() == 0)
      throw InputError(subject.where, "carries no surface: --cells or --elements draws its lattice");
    const ShareScope mapping(progress, 0, kPlaced);
    draw_body_surface(*subject.body, options, by, progress, panel);
  } else {
    draw_lattice(*subject.body, options, by, panel);
  }
  {
    const ShareScope tracing(progress, kPlaced, kTraced);
    panel.tracer = std::make_unique<Tracer>(make_tracer(panel.drawn));
  }
  if (panel.rest) {
    const ShareScope tracing(progress, kTraced, kTracedAtRest);
    panel.rest_tracer = std::make_unique<Tracer>(make_tracer(*panel.rest));
  }
  const ShareScope ranging(progress, kTracedAtRest, 1);
  find_range(by, panel);
  return panel;
}

}  // namespace flexel::picture
