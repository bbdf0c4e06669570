// Body attributes, and their way from cells to elements to the vertices of the surface.
#include "flexel/picture/attribute.h"

#include <Eigen/Core>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "formats/lattice/fields.h"

namespace flexel::picture {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// The cell under each vertex, by the first polygon that has one.
std::vector<std::optional<CellPoint>> cell_points(const Body& body) {
  const Surface& surface = body.surface;
  const std::vector<std::uint32_t> polygon = polygons_around_vertices(body);
  std::vector<std::optional<CellPoint>> points(surface.vertices.size());
  parallel_for_each(points.size(), [&](std::size_t v) {
    if (polygon[v] != kNoPolygonAround) points[v] = locate_on_surface(body, polygon[v], surface.vertices[v]);
  });
  return points;
}

// The column of that name, or the component that the name asks for.
std::optional<Attribute> in_columns(const Columns& columns, const std::string& name, Attribute::At at) {
  if (const auto found = columns.find(name); found != columns.end())
    return Attribute{at, scalars(found->second, std::nullopt)};
  const auto [column, component] = split_name(name);
  const auto found = columns.find(column);
  if (!component || found == columns.end() || *component >= found->second.components) return std::nullopt;
  return Attribute{at, scalars(found->second, component)};
}

}  // namespace

std::vector<std::string> body_attribute_names(const Body& body) {
  std::vector<std::string> names{"displacement", "strain"};
  if (body.cell_count() > 0) names.emplace_back("fill");
  for (const auto& [name, column] : body.element_columns) names.push_back(name);
  for (const auto& [name, column] : body.cell_columns) names.push_back(name);
  return names;
}

AttributeName split_name(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  int component = 0;
  if (dot == std::string::npos) return {name, std::nullopt};
  if (dot + 2 == name.size() && name.back() >= 'x' && name.back() <= 'z')
    return {name.substr(0, dot), name.back() - 'x'};
  const auto [end, error] = std::from_chars(name.data() + dot + 1, name.data() + name.size(), component);
  if (error != std::errc() || end != name.data() + name.size() || component < 0) return {name, std::nullopt};
  return {name.substr(0, dot), component};
}

std::vector<double> scalars(const Column& column, std::optional<int> component) {
  const auto width = static_cast<std::size_t>(column.components);
  std::vector<double> values(width == 0 ? 0 : column.values.size() / width);
  parallel_for_each(values.size(), [&](std::size_t i) {
    const Eigen::Map<const Eigen::VectorXd> row(column.values.data() + i * width, column.components);
    values[i] = component ? row[*component] : width == 1 ? row[0] : row.norm();
  });
  return values;
}

std::string no_stresses(const Body& body, const std::string& name) {
  const bool asked = name.find("stress") != std::string::npos || name.find("mises") != std::string::npos ||
                     name.find("principal") != std::string::npos;
  return asked && body.cell_count() == 0 ? " (model \"paper\" has no stresses)" : "";
}

Attribute strain(const Body& body) {
  return {body.cell_count() == 0 ? Attribute::At::elements : Attribute::At::cells, strains(body)};
}

std::vector<std::string> surface_attribute_names(const Surface& surface) {
  std::vector<std::string> names;
  for (const Columns* columns : {&surface.vertex_columns, &surface.polygon_columns})
    for (const auto& [name, column] : *columns)
      if (name != kColorColumn) names.push_back(name);
  return names;
}

std::optional<Attribute> surface_attribute(const Surface& surface, const std::string& name) {
  if (auto found = in_columns(surface.vertex_columns, name, Attribute::At::vertices)) return found;
  return in_columns(surface.polygon_columns, name, Attribute::At::polygons);
}

std::optional<Attribute> body_attribute(const Body& body, const std::string& name) {
  if (auto found = in_columns(body.element_columns, name, Attribute::At::elements)) return found;
  if (auto found = in_columns(body.cell_columns, name, Attribute::At::cells)) return found;
  if (name == "strain") return strain(body);
  if (name == "fill" && body.cell_count() > 0) return Attribute{Attribute::At::cells, body.fill};
  const auto [column, component] = split_name(name);
  if (column != "displacement") return std::nullopt;
  std::vector<Vec3> moved(body.element_count());
  parallel_for_each(moved.size(), [&](std::size_t e) { moved[e] = body.position[e] - body.rest[e]; });
  auto values = displacement_values(moved, component);
  return values ? std::optional(Attribute{Attribute::At::elements, std::move(*values)}) : std::nullopt;
}

std::optional<double> largest_in_matter(const Body& body, const std::string& name) {
  if (const auto column = body.element_columns.find(name); column != body.element_columns.end()) {
    const std::vector<double>& values = column->second.values;
    if (name != "von_mises" || values.empty()) return std::nullopt;
    return *std::max_element(values.begin(), values.end());
  }
  if (body.cell_columns.contains(name)) return std::nullopt;
  if (name == "displacement") return largest_displacement(body).value();
  if (name == "strain") return largest_strain(body);
  return std::nullopt;
}

std::optional<std::vector<double>> displacement_values(const std::vector<Vec3>& displacement,
                                                       std::optional<int> component) {
  if (component && *component > 2) return std::nullopt;
  std::vector<double> values(displacement.size());
  parallel_for_each(values.size(), [&](std::size_t i) {
    values[i] = component ? displacement[i][*component] : displacement[i].norm();
  });
  return values;
}

std::vector<double> at_elements(const Body& body, const Attribute& attribute) {
  if (attribute.at == Attribute::At::elements) return attribute.values;
  std::vector<double> sum(body.element_count(), 0), weight(body.element_count(), 0);
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    if (!std::isfinite(attribute.values[c])) continue;
    for (const std::uint32_t e : body.cell_elements[c]) {
      sum[e] += body.fill[c] * attribute.values[c];
      weight[e] += body.fill[c];
    }
  }
  for (std::size_t e = 0; e < sum.size(); ++e) sum[e] = weight[e] > 0 ? sum[e] / weight[e] : kUnknown;
  return sum;
}

std::vector<double> at_vertices(const Body& body, const Attribute& attribute,
                                const std::vector<std::uint32_t>& nearest_element) {
  const std::vector<double> elements = at_elements(body, attribute);
  std::vector<double> values(body.surface.vertices.size(), kUnknown);
  const auto points = cell_points(body);
  parallel_for_each(values.size(), [&](std::size_t v) {
    if (!points[v]) {
      values[v] = elements[nearest_element[v]];
      return;
    }
    values[v] = 0;
    for (std::size_t a = 0; a < 8; ++a)
      values[v] += points[v]->weights[a] * elements[body.cell_elements[points[v]->cell][a]];
  });
  return values;
}

}  // namespace flexel::picture
