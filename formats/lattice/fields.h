// Largest displacement, stress and the like of a deformed body, defined once for all stages. Each is taken
// over points of the part's matter, not over elements, some of which lie outside the part.
#pragma once
#include <optional>
#include <vector>

#include "formats/lattice/locate.h"

namespace flexel {

// (elements) 1: it lies in the part's matter or on its surface: an element of a whole cell (fill 1), and
// every element at centre placement.
[[nodiscard]] std::vector<std::uint8_t> elements_in_matter(const Body& body);

// (vertices) A polygon around each vertex of the surface under which a cell lies, the first; kNoPolygonAround
// where there is none.
constexpr std::uint32_t kNoPolygonAround = 0xffffffffu;
[[nodiscard]] std::vector<std::uint32_t> polygons_around_vertices(const Body& body);
// Likewise; (polygons) 1: a cell lies under it.
[[nodiscard]] std::vector<std::uint32_t> polygons_around_vertices(
    const Surface& surface, const std::vector<std::uint8_t>& with_cells);

struct LargestDisplacement {
  Vec3 displacement = Vec3::Zero();  // m
  Vec3 at = Vec3::Zero();            // m, at rest
  // Of the surface, on which `at` lies; kNoPolygonAround: an element.
  std::uint32_t polygon = kNoPolygonAround;
  [[nodiscard]] double value() const { return displacement.norm(); }
};

// The largest displacement of the part's matter: of the elements that lie in it and of its surface, there
// of the vertices and, in each cell, of the points of polygons and edges that are nearest to its middle: a
// polygon may move most where it has no vertex. Each is moved by the cell that carries it (trilinear
// weights, or the field of model `quadratic`). `displacement`: (elements x 3) m. Of equal ones the first,
// vertices before others. A body without a surface and without a whole cell: of all elements.
//
// Of a piece of a body (formats/pieces/other_pieces.h) that of its own matter, where `piece` is given.
struct SurfacePiece {
  const std::vector<std::uint8_t>& with_cells;  // (polygons) 1: cells of any piece lie under it
  const std::vector<std::uint8_t>& vertices;    // 1: one of this piece carries it
};
[[nodiscard]] LargestDisplacement largest_displacement(const Body& body,
                                                       const std::vector<Vec3>& displacement,
                                                       const SurfacePiece* piece = nullptr);
// Of the body's own positions.
[[nodiscard]] LargestDisplacement largest_displacement(const Body& body);
// Of the surface alone, by the body's own positions. Zero where no cell lies under it.
[[nodiscard]] LargestDisplacement largest_displacement_of_surface(const Body& body);

// Displacement [m] of the point `at` [m, at rest] of a polygon of the surface; nothing where no cell lies
// under the polygon. Of a body with other cells under the same surface it is that of the same point.
[[nodiscard]] std::optional<Vec3> displacement_on_surface(const Body& body, std::uint32_t polygon,
                                                          const Vec3& at);

// Equivalent (von Mises) logarithmic strain of a deformation gradient F, sqrt(2/3 e : e) with e the deviator
// of 1/2 ln(F^T F); NaN where F has no inverse or is turned inside out.
[[nodiscard]] double equivalent_strain(const Mat3& gradient);

// (cells) That of each cell's mean deformation gradient; or, of a body without cells, (elements) of a
// gradient fitted to the element's connections by least squares. NaN where there is none.
[[nodiscard]] std::vector<double> strains(const Body& body);

// The largest of strains() over cells that are not broken; 0 where there is none.
[[nodiscard]] double largest_strain(const Body& body);

}  // namespace flexel
