// A surface that is parted along cracks.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "formats/exchange/surface_file.h"
#include "mapping/anchors/vertex_anchor.h"
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

}  // namespace flexel::mapping
