// Mapping across a fracture: the surface is parted along the boundary between the Voronoi cells of the
// fragments' elements, so that each piece goes with its own elements only (docs/reference/cracks.md).
#pragma once
#include <optional>

#include "formats/exchange/surface_file.h"
#include "mapping/anchors/vertex_anchor.h"
#include "mapping/crack/crack_parted.h"
#include "mapping/methods/bind.h"
#include "mapping/methods/map_surface.h"
#include "mapping/types/crack_report.h"

namespace flexel::mapping {

// What --crack, --debris and --pieces ask for.
struct CrackOptions {
  CrackMode mode = CrackMode::keep;
  bool drop_debris = false;     // leave out pieces of a single element in parts that broke
  std::string pieces;           // where a file for each piece goes, as write_parts() wants it; "" nowhere
  SurfaceFormat pieces_format;  // where there are such files
};

// The parted surface.
struct CrackedSurface {
  // Its parts are the pieces that are kept, in order; vertices of the body's surface come first and as they
  // were, then new ones. Polygons that no crack crosses are as they were; others are triangles. Faces keep
  // their names; those on cracks are "crack". The polygons have a column "piece", numbered from 1.
  Surface surface;
  std::vector<std::uint32_t> part_piece;  // (parts of the surface) index into pieces
  std::vector<CrackPiece> pieces;
  VertexAnchors anchors;  // (vertices) each with its own fragment
  // Where a piece touches itself along an edge or in a point only, its vertices there are one for each side
  // and come out drawn apart by kDrawnApart spacings, or less where triangles are small; at rest they are
  // where they belong.
  struct Shift {
    std::uint32_t vertex;
    Vec3 by;  // m
  };
  std::vector<Shift> shifts;
};
constexpr double kDrawnApart = 1e-3;

// `parted`: cracks that end inside a part are opened up to their ends, where there are any.
// Throws InputError: no surface; `cap` of a part in fragments or with cracks inside whose surface is not
// closed or crosses itself.
[[nodiscard]] CrackedSurface part_surface(const Body& body, const Components& fragments,
                                          const PartedPairs& parted, const CrackOptions& options);
// The same with known anchors of the body's vertices, and shifts that some of them already have.
[[nodiscard]] CrackedSurface part_surface(const Body& body, const Components& fragments,
                                          const PartedPairs& parted, const CrackOptions& options,
                                          VertexAnchors anchors,
                                          std::vector<CrackedSurface::Shift> shifts = {});

// Volumes [m^3] of the pieces that are in the surface, its vertices at `vertices`; 0 of those left out.
[[nodiscard]] std::vector<double> piece_volumes(const CrackedSurface& cracked,
                                                const std::vector<Vec3>& vertices);

}  // namespace flexel::mapping
