// Holes in a part's surface: loops of open edges, and triangles that close them.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// A closed loop of edges with one triangle each.
struct Hole {
  std::vector<std::uint32_t> loop;  // vertices, in order
  Vec3 centre = Vec3::Zero();       // m, mean of the loop
  double width = 0;                 // m, diagonal of the loop's bounding box
  double share = 0;                 // area that closes it, over that of the surface around it (its shell)
  double shell_share = 0;           // area of that shell over that of the part
  bool filled = false;
  bool uncertain = false;  // not filled because its shape does not follow from what is around it
};

// A hole is small, and filled, where one triangle closes it that is under kLargestTriangle of its shell's
// area, or several that are under kLargestHole together, and all holes of a shell stay under kAllHoles: a
// plate whose round hole lost its wall would be plugged, with an error of twice that share of its volume.
constexpr double kLargestTriangle = .15, kLargestHole = .02, kAllHoles = .2;
// The uncertainty of filling a hole. Where the filling is not planar and, along some share of the rim, does
// not continue the surface smoothly (within 45 degrees), the missing matter may extend beyond it by the width
// of the hole: an uncertain volume of share x area x width. Holes are filled while the sum of these is at
// most kUncertain of the part's volume.
constexpr double kUncertain = .02;

struct FilledHoles {
  std::vector<Hole> holes;      // filled or not
  std::size_t triangles = 0;    // added
  std::size_t stray_edges = 0;  // open edges that form no loop
};

// Fills small holes by the triangulation of least area and dihedral angles (Liepa 2003, by CGAL); the
// triangles added have no polygon. Orientation is left to repair_orientation.
FilledHoles fill_holes(PartMesh& mesh);

}  // namespace flexel::voxelize
