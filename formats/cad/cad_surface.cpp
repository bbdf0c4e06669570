// Flat faces come with corners on their rims only: they get some to bend by.
#include "formats/cad/cad_surface.h"

#include <algorithm>

#include "base/error.h"
#include "formats/part/subdivide.h"
#include "formats/part/topology.h"

namespace flexel {
namespace {

// Turns the triangles [begin, end) of one solid outward, all together, where they enclose a negative volume.
void orient_outward(Surface& surface, std::size_t begin, std::size_t end) {
  std::vector<std::array<std::uint32_t, 3>> corners;
  for (std::size_t p = begin; p < end; ++p) {
    const auto polygon = surface.polygon(p);
    corners.push_back({polygon[0], polygon[1], polygon[2]});
  }
  if (signed_volume(surface.vertices, corners) >= 0) return;
  for (std::size_t p = begin; p < end; ++p)
    std::swap(surface.polygon_vertices[3 * p + 1], surface.polygon_vertices[3 * p + 2]);
}

// Default for the largest edge: a share of the diagonal of all solids together. A lattice has cells of one
// size for all of them, so the bolts of a machine need no finer mesh than its frame to bend as their cells
// do.
constexpr double kDefaultEdges = 64;

// Without a limit of the user's the edges become as short as kMostTriangles allow.
void refine(Surface& surface, const ImportOptions& options, const std::string& where) {
  if (options.largest_edge) return subdivide(surface, 0, *options.largest_edge, where);
  const double largest = bounding_box(surface.vertices).diagonal() / kDefaultEdges;
  if (largest > 0) static_cast<void>(subdivide(surface, 0, largest, kMostTriangles));
}

// The colours of the faces as those of their polygons.
void add_colors(Surface& surface, const std::vector<double>& face_colors) {
  if (face_colors.empty()) return;
  Column column{3, {}};
  column.values.reserve(3 * surface.polygon_count());
  for (const std::size_t face : surface.polygon_face)
    for (std::size_t i = 0; i < 3; ++i) column.values.push_back(face_colors[3 * face + i]);
  surface.polygon_columns[kColorColumn] = std::move(column);
}

}  // namespace

Surface cad_surface(CadMesh mesh, SurfaceSource source, const ImportOptions& options,
                    const std::string& where) {
  Surface surface = std::move(mesh.surface);
  surface.sources.assign(1, std::move(source));
  surface.part_source.assign(surface.parts.size(), 0);
  check(surface, where);
  const std::size_t polygons = surface.polygon_count();
  if (surface.polygon_vertices.size() != 3 * polygons)
    throw InputError(where, "is damaged: OpenCASCADE gives polygons that are no triangles");
  for (std::size_t begin = 0, end = 0; begin < polygons; begin = end) {
    while (end < polygons && surface.polygon_part(end) == surface.polygon_part(begin)) ++end;
    orient_outward(surface, begin, end);
  }
  refine(surface, options, where);
  add_colors(surface, mesh.face_colors);
  return surface;
}

}  // namespace flexel
