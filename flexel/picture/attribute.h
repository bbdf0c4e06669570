// The values that a picture can be coloured by.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::picture {

// One value for each element, cell, vertex or polygon; SI; NaN where nothing is known.
struct Attribute {
  enum class At : std::uint8_t { elements, cells, vertices, polygons };
  At at = At::elements;
  std::vector<double> values;
};

// The attributes of a surface: the columns of its vertices and polygons but for its colour; vectors as below.
[[nodiscard]] std::optional<Attribute> surface_attribute(const Surface& surface, const std::string& name);
[[nodiscard]] std::vector<std::string> surface_attribute_names(const Surface& surface);

// The attributes of a body: "displacement" [m], "strain" (equivalent logarithmic), "fill", and its columns,
// whose vectors give their length, or one component as "NAME.0" or "NAME.x".
[[nodiscard]] std::optional<Attribute> body_attribute(const Body& body, const std::string& name);
[[nodiscard]] std::vector<std::string> body_attribute_names(const Body& body);

// Why a body without cells has none of that name, " (model ...)", where the name is one of stresses; else nothing.
[[nodiscard]] std::string no_stresses(const Body& body, const std::string& name);

// strains() of formats/lattice/fields.h, of cells or elements.
[[nodiscard]] Attribute strain(const Body& body);

// The largest "displacement", "strain" or "von_mises" of the part's matter, as the summary of a run gives it
// (formats/lattice/fields.h, simulate/matter/stress.h); nothing for other names.
[[nodiscard]] std::optional<double> largest_in_matter(const Body& body, const std::string& name);

// Values of cells at the elements: the mean over the element's cells, weighted by fill.
[[nodiscard]] std::vector<double> at_elements(const Body& body, const Attribute& attribute);

// Values at the surface's vertices: interpolated in the cell under the vertex, or those of the element that
// `nearest_element` (vertices) names.
[[nodiscard]] std::vector<double> at_vertices(const Body& body, const Attribute& attribute,
                                              const std::vector<std::uint32_t>& nearest_element);

// One value a row: the length of a vector, or component `component`.
[[nodiscard]] std::vector<double> scalars(const Column& column, std::optional<int> component);

// "velocity.2" and "velocity.z" are component 2 of "velocity".
struct AttributeName {
  std::string column;
  std::optional<int> component;
};
[[nodiscard]] AttributeName split_name(const std::string& name);

// One value a displacement: its length, or a component; nothing for a component that it does not have.
[[nodiscard]] std::optional<std::vector<double>> displacement_values(const std::vector<Vec3>& displacement,
                                                                     std::optional<int> component);

}  // namespace flexel::picture
