// `shape-functions`: the field of model `quadratic` itself, at each vertex; no frame comes between.
#include "mapping/methods/shape_functions.h"

#include "base/error.h"
#include "base/parallel.h"
#include "formats/lattice/quadratic_field.h"
#include "mapping/methods/bind.h"

namespace flexel::mapping {

std::vector<Vec3> VertexCells::apply(const Binding&, const Body& body,
                                     const std::vector<Vec3>& position) const {
  if (!QuadraticField::is_in(body))
    throw InputError(
        "--method shape-functions needs a body that model \"quadratic\" deformed; take another --method");
  std::vector<Vec3> elements(position.size()), displacement(cell.size());
  parallel_for_each(elements.size(), [&](std::size_t e) { elements[e] = position[e] - body.rest[e]; });
  const QuadraticField field(body, elements);
  const std::vector<std::uint32_t> part = cell_parts(body);
  parallel_for_each(cell.size(), [&](std::size_t v) {
    const std::uint32_t own = cell[v];
    displacement[v] =
        field.displacement(own, cell_coordinates(body, body.parts[part[own]], own, body.surface.vertices[v]));
  });
  return displacement;
}

namespace {

// The cell that a vertex is anchored in; for one at an element, that on its side.
std::shared_ptr<const MethodBinding> bind_cells(MethodInput& input) {
  const Body& body = input.body;
  if (body.cell_count() == 0)
    throw InputError("--method shape-functions needs elements at the corners of the voxels");
  // (elements x 8) the cell that has the element at a corner, or any that has it
  std::vector<std::array<std::uint32_t, 8>> cell_at(body.element_count());
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    for (const std::uint32_t e : body.cell_elements[c]) cell_at[e].fill(c);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    for (std::size_t a = 0; a < 8; ++a) cell_at[body.cell_elements[c][a]][a] = c;
  auto kept = std::make_shared<VertexCells>();
  kept->cell.resize(input.anchors.size());
  parallel_for_each(kept->cell.size(), [&](std::size_t v) {
    const VertexAnchor& anchor = input.anchors[v];
    kept->cell[v] = anchor.in_cell ? anchor.owner : cell_at[anchor.owner][~anchor.octant & 7];
  });
  return kept;
}

}  // namespace

constinit const MappingMethod kShapeFunctions{
    .name = "shape-functions", .help = "what model quadratic found, its default", .bind = bind_cells};

}  // namespace flexel::mapping
