// Surface: the part's own mesh, as it came. What the user gets back is this mesh with other vertex positions.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/files/files.h"
#include "base/math/vec.h"
#include "formats/part/column.h"

namespace flexel {

// A face that can be selected: a CAD face, a named group, or, in a mesh without groups, a region between
// edges with a dihedral angle over 30 degrees. Faces are numbered from 1 within their part, in order of
// appearance: "bracket/12".
struct SurfaceFace {
  std::string name;        // the file's own name for it, or ""
  std::uint32_t part = 0;  // index into Surface::parts
};

// One solid of the input.
struct SurfacePart {
  // unique within the surface; the file's own name, else the file's stem ("-2" ... appended)
  std::string name;
  // The assemblies of the file that hold it, from the outermost: "gearbox/shaft-2"; "": none.
  std::string assembly{};
};

// Where the surface came from, and what is needed to write the same file again.
struct SurfaceSource {
  std::string file;         // name as given, without folders; "stdin" for a pipe
  std::string format;       // "stl-binary", "stl-ascii", "obj", "ply-binary", "ply-ascii", "off", "glb"
                            // (glTF too), "3mf", "step", "iges", "brep"
  double unit = 1e-3;       // metres per unit of the file's coordinates
  bool unit_given = false;  // the file itself or the user said so (else the default, mm, was assumed)
  std::uint64_t hash = 0;   // content_hash of the file
  Bytes bytes;  // the file itself, for formats that are written again from it (OBJ, PLY, OFF, glTF
                // as one GLB, 3MF); else empty
  std::vector<std::byte> stl_header;  // the 80 bytes of a binary STL's header; else empty
  // Where the surface's vertices are not in the order of those in `bytes`: for each of the file's, the surface's.
  std::vector<std::uint32_t> order{};
};

struct Surface {
  std::vector<Vec3> vertices;  // (vertices x 3) m, world frame; the file's own order. STL, which has no
                               // vertices of its own: exactly equal positions of a solid are one, in
                               // order of first use. No vertex belongs to two parts
  // (polygons + 1) polygon p owns corners [offsets[p], offsets[p + 1])
  std::vector<std::uint32_t> polygon_offsets;
  std::vector<std::uint32_t> polygon_vertices;  // (corners) indices into vertices
  std::vector<std::uint32_t> polygon_face;      // (polygons) index into faces
  // Attributes of the file, by name: kColorColumn ("color"), and numbers of other names ("quality"). A part's
  // or face's colour is that of its polygons. None where the file has none.
  Columns vertex_columns;   // (vertices)
  Columns polygon_columns;  // (polygons)
  std::vector<SurfaceFace> faces;
  std::vector<SurfacePart> parts;
  std::vector<SurfaceSource> sources;      // one per input file
  std::vector<std::uint32_t> part_source;  // (parts) index into sources

  [[nodiscard]] std::size_t polygon_count() const {
    return polygon_offsets.empty() ? 0 : polygon_offsets.size() - 1;
  }
  [[nodiscard]] std::span<const std::uint32_t> polygon(std::size_t p) const {
    return {polygon_vertices.data() + polygon_offsets[p], polygon_offsets[p + 1] - polygon_offsets[p]};
  }
  [[nodiscard]] std::uint32_t polygon_part(std::size_t p) const { return faces[polygon_face[p]].part; }
};

// Triangles of a surface, each with the polygon it came from.
struct Triangles {
  std::vector<std::array<std::uint32_t, 3>> corners;  // (triangles x 3) indices into Surface::vertices
  std::vector<std::uint32_t> polygon;                 // (triangles) index of the polygon
};

// Triangulates every polygon: triangles as they are, convex polygons as a fan, non-convex ones by clipping
// ears in the plane of their area vector. Deterministic. Each polygon of n corners gives n - 2 triangles.
[[nodiscard]] Triangles triangulate(const Surface& surface);

// Coordinates finite and below kLargestCoordinate, indices in range, offsets ascending, polygons of at least
// three corners, at least one polygon, no vertex in two parts, tables and columns consistent. Throws
// InputError(where, ...) naming the first vertex or polygon that is wrong, numbered from 1, or the column.
void check(const Surface& surface, const std::string& where);

// Number of the face within its part, from 1, and its selection name "part/12".
[[nodiscard]] std::vector<std::uint32_t> face_numbers(const Surface& surface);

// Where products of three coordinates are still far from overflow, and no part reaches.
constexpr double kLargestCoordinate = 1e12;  // m

// Gives parts without a name `fallback`, and repeated names a number: "-2", "-3" ...; the first keeps its
// name.
void make_part_names_unique(Surface& surface, const std::string& fallback);

// Appends `other` (another input file) to `surface`; part names stay unique. Attributes that only one of them
// has: append_columns().
void append(Surface& surface, Surface other);

}  // namespace flexel
