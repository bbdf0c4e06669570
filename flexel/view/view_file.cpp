// Each state is mapped as flexel-map does it; its fields go to the vertices as for flexel picture, and from there to the points
// that are drawn.
#include "flexel/view/view_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "base/units.h"
#include "flexel/picture/attribute.h"
#include "flexel/view/carved_surface.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/lattice/locate.h"
#include "mapping/map_refined.h"
#include "mapping/methods/map_surface.h"
#include "mapping/refine/refine.h"
#include "mapping/series.h"

namespace flexel::view {
namespace {

using picture::Attribute;

std::vector<std::string> field_names(const Body* body, const Surface& surface) {
  std::vector<std::string> names;
  if (body != nullptr)
    for (std::string& name : picture::body_attribute_names(*body))
      if (name != "displacement" && name != "fill") names.push_back(std::move(name));
  for (std::string& name : picture::surface_attribute_names(surface))
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(std::move(name));
  return names;
}

// The values of an attribute at the points: `vertices` are those of vertices or elements.
std::vector<double> at_points(const Shape& shape, const std::vector<double>& values, bool by_owner) {
  const std::vector<std::uint32_t>& from = by_owner ? shape.owner : shape.source;
  std::vector<double> result(from.size());
  parallel_for_each(from.size(), [&](std::size_t p) { result[p] = values[from[p]]; });
  return result;
}

std::vector<double> unknown(const Shape& shape) {
  return std::vector<double>(shape.rest.size(), std::numeric_limits<double>::quiet_NaN());
}

std::vector<double> surface_values(const Surface& surface, const Shape& shape, const std::string& name) {
  const std::optional<Attribute> attribute = picture::surface_attribute(surface, name);
  if (!attribute) return unknown(shape);
  return at_points(shape, attribute->values, attribute->at == Attribute::At::polygons);
}

// Of a body's state, mapped as `mapped`.
std::vector<double> body_values(const Body& body, const mapping::MapResult& mapped, const Shape& shape,
                                const std::string& name) {
  const std::optional<Attribute> attribute = picture::body_attribute(body, name);
  if (!attribute) return surface_values(body.surface, shape, name);
  std::vector<std::uint32_t> nearest(mapped.frame.size());
  for (std::size_t v = 0; v < nearest.size(); ++v) nearest[v] = mapped.frame_of(v).elements[0];
  return at_points(shape, picture::at_vertices(body, *attribute, nearest), false);
}

// (points x 3) m
std::vector<Vec3> moved_points(const Shape& shape, const std::vector<Vec3>& displacement,
                               const std::string& where) {
  std::vector<Vec3> result(shape.source.size());
  for (std::size_t p = 0; p < result.size(); ++p) {
    result[p] = displacement[shape.source[p]];
    if (!result[p].allFinite() || result[p].cwiseAbs().maxCoeff() > kLargestCoordinate)
      throw InputError(where, "its surface cannot be shown: the mapping gives positions that are not finite");
  }
  return result;
}

bool has_polygon_values(const Surface& surface) {
  return !surface.polygon_columns.empty();
}

std::vector<std::uint8_t> own_colours(const Surface& surface, const Shape& shape) {
  const auto of_vertices = surface.vertex_columns.find(kColorColumn);
  const auto of_polygons = surface.polygon_columns.find(kColorColumn);
  const bool by_vertex = of_vertices != surface.vertex_columns.end();
  if (!by_vertex && of_polygons == surface.polygon_columns.end()) return {};
  const Column& column = by_vertex ? of_vertices->second : of_polygons->second;
  const std::vector<std::uint32_t>& from = by_vertex ? shape.source : shape.owner;
  std::vector<std::uint8_t> colours(3 * from.size());
  for (std::size_t p = 0; p < from.size(); ++p)
    for (std::size_t a = 0; a < 3; ++a) {
      const double share = column.values[from[p] * static_cast<std::size_t>(column.components) + a];
      colours[3 * p + a] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
    }
  return colours;
}

void set_names(const Surface& surface, ViewFile& file) {
  for (const SurfacePart& part : surface.parts) file.parts.push_back(part.name);
  file.faces = surface.faces;
  file.face_numbers = face_numbers(surface);
}

Drawn begin_surface(const Surface& surface, ViewFile& file) {
  Drawn drawn;
  drawn.shape = surface_shape(surface, has_polygon_values(surface));
  drawn.colours = own_colours(surface, drawn.shape);
  set_names(surface, file);
  file.facts.emplace_back("triangles", human_count(drawn.shape.triangles.size()));
  return drawn;
}

void add_facts(const Body& body, ViewFile& file) {
  file.facts.emplace_back("elements", human_count(body.element_count()));
  if (body.cell_count() > 0) file.facts.emplace_back("cells", human_count(body.cell_count()));
  for (const Part& part : body.parts) {
    std::string text = fmt::format("spacing {}", human_length(part.lattice.spacing.minCoeff()));
    if (!part.material.empty()) text += ", " + part.material;
    file.facts.emplace_back(part.name, text);
  }
  for (const auto& [name, text] : body.notes) file.facts.emplace_back(name, text.substr(0, 2000));
}

void add_state(const Body& body, const mapping::MapResult& mapped, const std::string& where, Drawn& drawn) {
  drawn.displacement.push_back(moved_points(drawn.shape, mapped.displacement, where));
  for (Field& field : drawn.fields)
    field.values.push_back(body_values(body, mapped, drawn.shape, field.name));
}

void begin_fields(const std::vector<std::string>& names, Drawn& drawn) {
  for (const std::string& name : names) drawn.fields.push_back({name, {}, {}});
}

// An attribute that was asked for is one of them: a component too.
void add_asked(const Body* body, const Surface& surface, const ViewOptions& options, const std::string& where,
               std::vector<std::string>& names) {
  if (options.colour.empty() || options.colour == "none") return;
  if (std::find(names.begin(), names.end(), options.colour) != names.end()) return;
  if (body != nullptr && picture::split_name(options.colour).column == "displacement") return;
  if (!(body != nullptr && picture::body_attribute(*body, options.colour)) &&
      !picture::surface_attribute(surface, options.colour)) {
    std::vector<std::string> known = names;
    if (body != nullptr) known.insert(known.begin(), "displacement");
    known.emplace_back("none");
    throw NoSuchAttribute(
        where, fmt::format("has no attribute \"{}\" to colour by{}; --color takes {}{}", options.colour,
                           body ? picture::no_stresses(*body, options.colour) : "", fmt::join(known, ", "),
                           did_you_mean(options.colour, known)));
  }
  names.push_back(options.colour);
}

Drawn draw_lattice(const Body& body) {
  Drawn drawn;
  drawn.shape = lattice_shape(body);
  std::vector<Vec3> displacement(body.element_count());
  for (std::size_t e = 0; e < displacement.size(); ++e) displacement[e] = body.position[e] - body.rest[e];
  drawn.displacement.push_back(moved_points(drawn.shape, displacement, ""));
  for (const std::string& name : picture::body_attribute_names(body)) {
    if (name == "displacement") continue;
    const Attribute attribute = *picture::body_attribute(body, name);
    drawn.fields.push_back(
        {name, {at_points(drawn.shape, attribute.values, attribute.at == Attribute::At::cells)}, {}});
  }
  return drawn;
}

void set_largest(const Body& body, Drawn& drawn) {
  for (Field& field : drawn.fields) field.largest = picture::largest_in_matter(body, field.name);
}

void show_body(const Body& body, const ViewOptions& options, const std::string& where, ViewFile& file,
               Progress& progress) {
  add_facts(body, file);
  const bool has_surface = body.surface.polygon_count() > 0;
  if (!has_surface && body.cell_count() == 0)
    throw InputError(where, "carries neither a surface nor cells: there is nothing to show");
  if (options.cells || !has_surface) {
    if (body.cell_count() == 0) throw InputError(where, "has no cells (placement centre): leave --cells out");
    file.lattice = draw_lattice(body);
    set_largest(body, *file.lattice);
  }
  if (!has_surface) {
    for (const Part& part : body.parts) file.parts.push_back(part.name);
    return;
  }
  mapping::MapOptions how;
  how.method = mapping::default_method(body);
  constexpr double kFirst = 0.3, kMapped = 0.5;  // of the time
  mapping::MapResult mapped = [&] {
    const ShareScope first(progress, 0, kFirst);
    return map_surface(body, how, progress);
  }();
  const std::optional<Body> split = split_where_coarse(body, mapped, progress);
  if (split) {
    const ShareScope second(progress, kFirst, kMapped);
    mapped = map_surface(*split, how, progress);
  }
  progress.update(kMapped, "drawing");
  const Body& shown = split ? *split : body;
  file.surface = begin_surface(shown.surface, file);
  std::vector<std::string> names = field_names(&shown, shown.surface);
  add_asked(&shown, shown.surface, options, where, names);
  begin_fields(names, *file.surface);
  add_state(shown, mapped, where, *file.surface);
  set_largest(shown, *file.surface);
}

// Frames share one binding until the lattice changes, and the first one's surface.
void show_series(const std::string& pvd, const ViewOptions& options, ViewFile& file, Progress& progress) {
  const std::vector<std::string> files = mapping::series_files(pvd);
  file.times = mapping::series_times(pvd);
  Body body = read_body(files.front());
  if (body.surface.polygon_count() == 0)
    throw InputError(files.front(), "carries no surface: take a series of a body that has one");
  add_facts(body, file);
  mapping::MapOptions how;
  how.method = mapping::default_method(body);
  const mapping::RefinedSeries found = refinement_of_series(body, files, how, false, progress);
  if (found.refinement && found.refinement->changes())
    mapping::take_refined(body, refined(body.surface, *found.refinement), *found.refinement);
  file.surface = begin_surface(body.surface, file);
  std::vector<std::string> names = field_names(&body, body.surface);
  const Body last = read_frame(files.back());  // it may have what the first has not
  for (std::string& name : field_names(&last, body.surface))
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(std::move(name));
  add_asked(&body, body.surface, options, files.front(), names);
  begin_fields(names, *file.surface);
  std::optional<mapping::Binding> binding;
  for (std::size_t f = 0; f < files.size(); ++f) {
    progress.update(static_cast<double>(f) / static_cast<double>(files.size()), files[f]);
    if (f > 0) {
      Body next = read_frame(files[f]);
      take_surface(next, body, files[f]);
      if (!mapping::same_lattice(next, body)) binding.reset();
      body = std::move(next);
    }
    if (!binding) binding = bind(body, how.method, files.size() - f);
    add_state(body, map_state(*binding, body), files[f], *file.surface);
  }
}

// The nearest element alone, for points over no cell.
std::uint32_t nearest_element(const Body& body, const Vec3& point) {
  std::uint32_t nearest = 0;
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    if ((body.rest[e] - point).squaredNorm() < (body.rest[nearest] - point).squaredNorm()) nearest = e;
  return nearest;
}

constexpr std::size_t kCorners = 8;

// By a cell, or by `element(point)` alone.
template <class Element>
void carry(const Body& body, std::size_t point, const std::optional<CellPoint>& at, const Element& element,
           Drawn& drawn) {
  drawn.weights[kCorners * point] = 1;
  if (!at) drawn.carriers[kCorners * point] = element();
  for (std::size_t a = 0; at && a < kCorners; ++a) {
    drawn.carriers[kCorners * point + a] = body.cell_elements[at->cell][a];
    drawn.weights[kCorners * point + a] = at->weights[a];
  }
}

void make_carriers(Drawn& drawn) {
  drawn.carriers.assign(kCorners * drawn.shape.rest.size(), 0);
  drawn.weights.assign(kCorners * drawn.shape.rest.size(), 0);
}

void carry(const Body& body, Drawn& drawn) {
  make_carriers(drawn);
  parallel_for_each(drawn.shape.rest.size(), [&](std::size_t p) {
    const Vec3& point = drawn.shape.rest[p];
    carry(
        body, p, locate_on_surface(body, drawn.shape.owner[p], point),
        [&] { return nearest_element(body, point); }, drawn);
  });
}

void carry(const Body& body, const CarvedSurface& carved, Drawn& drawn) {
  make_carriers(drawn);
  for (std::size_t p = 0; p < drawn.shape.rest.size(); ++p) {
    const std::uint32_t vertex = drawn.shape.source[p];
    carry(
        body, p, carved.cell[vertex], [&] { return carved.element[vertex]; }, drawn);
  }
}

}  // namespace

ViewFile make_live_file(const Body& body, const std::string& label) {
  ViewFile file;
  file.label = label;
  add_facts(body, file);
  if (body.notes.contains(kCarvedNote)) {
    const CarvedSurface carved = carved_surface(body);
    file.surface = begin_surface(carved.surface, file);
    file.face_numbers = carved.face_numbers;
    carry(body, carved, *file.surface);
  } else {
    file.surface = begin_surface(body.surface, file);
    carry(body, *file.surface);
  }
  return file;
}

ViewFile make_view_file(const ViewSubject& subject, const ViewOptions& options, Progress& progress) {
  ViewFile file;
  file.label = subject.label;
  if (!subject.series.empty()) {
    show_series(subject.series, options, file, progress);
    return file;
  }
  if (subject.body) {
    show_body(*subject.body, options, subject.where, file, progress);
    return file;
  }
  file.surface = begin_surface(subject.surface, file);
  std::vector<std::string> names = field_names(nullptr, subject.surface);
  add_asked(nullptr, subject.surface, options, subject.where, names);
  begin_fields(names, *file.surface);
  for (Field& field : file.surface->fields)
    field.values.push_back(surface_values(subject.surface, file.surface->shape, field.name));
  return file;
}

}  // namespace flexel::view
