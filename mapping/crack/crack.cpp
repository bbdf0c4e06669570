// For each part: boxes, cut, walls, pieces. Degenerate positions (a point on a plane, two coincident points)
// show as an odd count or an open edge; the part is then cut again with its boxes shifted a little further.
#include "mapping/crack/crack.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/stop.h"
#include "formats/part/topology.h"
#include "mapping/crack/crack_pieces.h"

namespace flexel::mapping {
namespace {

// In spacings. Parts are modelled in round numbers, and lattices are snapped to them: these are not round.
const Vec3 kShift = Vec3(0.8310341, 1.0471976, 0.6180340) * 1e-4;
constexpr int kAttempts = 8;
constexpr double kFarthestBox = 1 << 20;

// The surface of one part, ready to be cut.
struct PartSurface {
  std::vector<std::array<std::uint32_t, 3>> triangles;  // vertices
  std::vector<std::uint32_t> polygon;                   // (triangles)
};

PartSurface surface_of(const Surface& surface, const Triangles& triangles, std::uint32_t part) {
  PartSurface result;
  for (std::size_t t = 0; t < triangles.corners.size(); ++t)
    if (surface.polygon_part(triangles.polygon[t]) == part) {
      result.triangles.push_back(triangles.corners[t]);
      result.polygon.push_back(triangles.polygon[t]);
    }
  return result;
}

// Edges with more than two sides are no hindrance as long as they are run through both ways equally often.
void refuse_open(const Part& part, const PartSurface& own, const std::vector<Vec3>& vertices,
                 const std::vector<std::uint32_t>& welded) {
  const Topology topology = flexel::topology(own.triangles, welded);
  std::string why;
  if (topology.open_edges > 0)
    why = fmt::format("is open ({} open edges)", topology.open_edges);
  else if (topology.misoriented_edges > 0)
    why = fmt::format("is not oriented ({} edges)", topology.misoriented_edges);
  else if (signed_volume(vertices, own.triangles) < 0)
    why = "is inside out";
  else
    return;
  throw InputError(fmt::format(
      "--crack cap: the surface of part \"{}\" {}, so its pieces would not be solids: take --crack "
      "open, or mend the part's file first",
      part.name, why));
}

struct Cutting {
  const Body& body;
  const Components& fragments;
  const PartedPairs& parted;
  const CrackOptions& options;
  const std::vector<std::uint32_t>& welded;
};

CapOutcome cut_part(const Cutting& cutting, std::uint32_t part, const PartSurface& own,
                    const std::vector<Vec3>& u, const Vec3& shift, PieceBuilder& builder) {
  const Surface& surface = cutting.body.surface;
  std::vector<std::array<Vec3, 3>> corners;
  for (const auto& triangle : own.triangles)
    corners.push_back({u[triangle[0]], u[triangle[1]], u[triangle[2]]});
  const CrackBoxes boxes(cutting.body, part, cutting.fragments, cutting.parted, shift, corners);
  const Part& of = cutting.body.parts[part];
  CrackMesh mesh(surface, cutting.welded, u, of.lattice, of.placement == Placement::centre ? 0.5 : 0,
                 own.triangles, boxes);
  if (!mesh.split()) return CapOutcome::degenerate;
  const bool cap = cutting.options.mode == CrackMode::cap;
  CrackEdges edges;
  if (!cap) edges.find_ends(mesh);
  CapOutcome outcome = cap ? edges.find(mesh) : CapOutcome::done;
  if (outcome != CapOutcome::done) return outcome;
  mesh.halve_cuts();
  mesh.insert_points();
  std::vector<CrackCap> caps;
  if (cap) outcome = make_caps(mesh, edges, caps);
  if (outcome != CapOutcome::done) return outcome;
  resolve_mixed(cutting.body, own.polygon, cutting.fragments, mesh, caps);
  const CrackPolygons polygons = gather_polygons(surface, mesh, own.polygon, caps);
  if (cap && !is_closed(mesh, polygons)) return CapOutcome::degenerate;
  builder.add_pieces(mesh, polygons);
  return CapOutcome::done;
}

// (vertices x 3) in box coordinates of the part; only those of its triangles.
std::vector<Vec3> box_coordinates(const Body& body, std::uint32_t part, const PartSurface& own) {
  const Part& of = body.parts[part];
  const double half = of.placement == Placement::centre ? 0.5 : 0;
  std::vector<Vec3> u(body.surface.vertices.size(), Vec3::Zero());
  for (const auto& triangle : own.triangles)
    for (const std::uint32_t v : triangle) {
      u[v] = of.lattice.to_lattice(body.surface.vertices[v]) - Vec3::Constant(half);
      if (!(u[v].cwiseAbs().maxCoeff() < kFarthestBox))
        throw InputError("--crack: the surface of part \"" + of.name +
                         "\" reaches too far from its lattice to be cut");
    }
  return u;
}

void cut_broken_part(const Cutting& cutting, std::uint32_t part, const Triangles& triangles,
                     PieceBuilder& builder) {
  const Body& body = cutting.body;
  const PartSurface own = surface_of(body.surface, triangles, part);
  if (cutting.options.mode == CrackMode::cap)
    refuse_open(body.parts[part], own, body.surface.vertices, cutting.welded);
  const std::vector<Vec3> u = box_coordinates(body, part, own);
  CapOutcome outcome = CapOutcome::degenerate;
  for (int attempt = 0; attempt < kAttempts && outcome != CapOutcome::done; ++attempt)
    outcome = cut_part(cutting, part, own, u, (1 + 0.7 * attempt) * kShift, builder);
  if (outcome == CapOutcome::done) return;
  throw InputError(
      fmt::format("--crack {}: the surface of part \"{}\" {} where it broke: take --crack {}, or mend the "
                  "part's file first",
                  name_of(cutting.options.mode), body.parts[part].name,
                  outcome == CapOutcome::crosses_itself ? "crosses itself, or has shells that overlap,"
                                                        : "cannot be cut cleanly",
                  cutting.options.mode == CrackMode::cap ? "open" : "keep"));
}

}  // namespace

std::vector<double> piece_volumes(const CrackedSurface& cracked, const std::vector<Vec3>& vertices) {
  const Triangles triangles = triangulate(cracked.surface);
  std::vector<std::vector<std::array<std::uint32_t, 3>>> own(cracked.pieces.size());
  for (std::size_t t = 0; t < triangles.corners.size(); ++t)
    own[cracked.part_piece[cracked.surface.polygon_part(triangles.polygon[t])]].push_back(
        triangles.corners[t]);
  std::vector<double> volumes;
  for (const auto& piece : own) volumes.push_back(piece.empty() ? 0 : signed_volume(vertices, piece));
  return volumes;
}

CrackedSurface part_surface(const Body& body, const Components& fragments, const PartedPairs& parted,
                            const CrackOptions& options) {
  return part_surface(body, fragments, parted, options, locate_vertices(body));
}

CrackedSurface part_surface(const Body& body, const Components& fragments, const PartedPairs& parted,
                            const CrackOptions& options, VertexAnchors anchors,
                            std::vector<CrackedSurface::Shift> shifts) {
  PieceBuilder builder(body, fragments, options, std::move(anchors), std::move(shifts));
  const Triangles triangles = triangulate(body.surface);
  const std::vector<std::uint32_t> welded = weld(body.surface.vertices);
  const Cutting cutting{body, fragments, parted, options, welded};
  for (std::uint32_t part = 0; part < body.parts.size(); ++part) {
    if (fragments.in_pieces(part) || parted.inside(part))
      cut_broken_part(cutting, part, triangles, builder);
    else
      builder.add_whole(part);
    check_stop();
  }
  CrackedSurface cracked = builder.take();
  if (options.mode == CrackMode::cap) {
    const std::vector<double> volumes = piece_volumes(cracked, cracked.surface.vertices);
    for (std::size_t p = 0; p < volumes.size(); ++p) cracked.pieces[p].volume_before = volumes[p];
  }
  if (options.drop_debris) drop_debris(cracked);
  return cracked;
}

}  // namespace flexel::mapping
