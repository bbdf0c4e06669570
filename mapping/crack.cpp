// Part by part: boxes, cut, walls, pieces. What rounding can spoil (a point on a plane, two points at one
// place) shows as an odd count or an open edge; the part is then cut again with its boxes shifted a little
// further.
#include "mapping/crack.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "formats/error.h"
#include "formats/stop.h"
#include "formats/topology.h"
#include "mapping/crack_carved.h"
#include "mapping/crack_pieces.h"

namespace flexel {
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

// Volumes of the pieces that are in the surface, by piece.
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

}  // namespace

CrackedSurface part_surface(const Body& body, const Components& fragments, const PartedPairs& parted,
                            const CrackOptions& options) {
  return part_surface(body, fragments, parted, options, take_seats(body));
}

CrackedSurface part_surface(const Body& body, const Components& fragments, const PartedPairs& parted,
                            const CrackOptions& options, Seats seats,
                            std::vector<CrackedSurface::Shift> shifts) {
  PieceBuilder builder(body, fragments, options, std::move(seats), std::move(shifts));
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

namespace {

// Triangles of the body's surface whose corners go with different fragments, or with elements on the two
// sides of a crack inside one: `parted`, of a surface that was not opened there.
std::size_t spanning_triangles(const Body& body, const MapResult& result, const Components& fragments,
                               const PartedPairs* parted) {
  const Triangles triangles = triangulate(body.surface);
  std::size_t count = 0;
  for (const auto& corner : triangles.corners) {
    bool spans = false;
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t a = result.frame_of(corner[c]).elements[0],
                          b = result.frame_of(corner[(c + 1) % 3]).elements[0];
      spans = spans || fragments.of[a] != fragments.of[b] || (parted && parted->contains(a, b));
    }
    count += spans;
  }
  return count;
}

// What hangs together, and what does not.
struct Broken {
  Adjacency connections;
  Components fragments;
  PartedPairs parted;
  explicit Broken(const Body& body)
      : connections(element_adjacency(body)),
        fragments(find_components(body, connections)),
        parted(body, fragments, connections) {}
  Broken(const Broken&) = delete;
  Broken& operator=(const Broken&) = delete;
  // Of parts that are in more than one.
  [[nodiscard]] std::size_t pieces() const {
    std::size_t count = 0;
    for (std::uint32_t part = 0; part + 1 < fragments.offset.size(); ++part)
      if (fragments.in_pieces(part)) count += fragments.offset[part + 1] - fragments.offset[part];
    return count;
  }
  [[nodiscard]] bool cracked_inside() const {
    for (std::uint32_t part = 0; part + 1 < fragments.offset.size(); ++part)
      if (parted.inside(part)) return true;
    return false;
  }
};

// Puts what is a body's own back, whatever happens.
template <class Value>
class Loan {
 public:
  Loan(Value& own, Value& lent) : own_(own), lent_(lent) { std::swap(own_, lent_); }
  Loan(const Loan&) = delete;
  Loan& operator=(const Loan&) = delete;
  ~Loan() { std::swap(own_, lent_); }

 private:
  Value &own_, &lent_;
};

void map_pieces(Body& body, const Components& fragments, const MapOptions& options, CrackMode mode,
                MappedPart& mapped, Progress& progress) {
  CrackedSurface& cracked = *mapped.cracked;
  {
    const Loan loan(body.surface, cracked.surface);
    std::vector<Vec3>& vertices = body.surface.vertices;
    std::vector<Vec3> at_rest;
    for (const auto& [vertex, by] : cracked.shifts) {
      at_rest.push_back(vertices[vertex]);
      vertices[vertex] += by;
    }
    mapped.result = map_surface(body, options, cracked.seats, progress);
    for (std::size_t s = 0; s < cracked.shifts.size(); ++s) {
      vertices[cracked.shifts[s].vertex] = at_rest[s];
      mapped.result.displacement[cracked.shifts[s].vertex] += cracked.shifts[s].by;
    }
    mapped.report = report(body, mapped.result);
    mapped.report.crack.spanning_triangles = spanning_triangles(body, mapped.result, fragments, nullptr);
    // What is open encloses nothing.
    if (mode == CrackMode::open)
      mapped.report.quality.volume_after = std::numeric_limits<double>::quiet_NaN();
  }
  if (mode != CrackMode::cap) return;
  std::vector<Vec3> moved = cracked.surface.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += mapped.result.displacement[v];
  const std::vector<double> volumes = piece_volumes(cracked, moved);
  for (std::size_t p = 0; p < volumes.size(); ++p) cracked.pieces[p].volume_after = volumes[p];
}

// What [[event]] carve took away leaves its surface behind (docs/events.md).
void warn_of_carved(const Body& body, Progress& progress) {
  if (body.notes.count(kCarvedNote) > 0)
    progress.warn(
        "matter was carved away, its surface is still here and follows what is left around it: --crack cap "
        "leaves it out and closes the part");
}

void map_carved(Body& body, const MapOptions& options, CrackMode mode, MappedPart& mapped,
                Progress& progress) {
  const Components fragments = find_components(body, element_adjacency(body));
  progress.update(0, "closing what was carved");
  mapped.cracked = close_carved(body, fragments, mode);
  map_pieces(body, fragments, options, mode, mapped, progress);
  CrackReport& crack = mapped.report.crack;
  crack.mode = mode;
  for (const CrackPiece& piece : mapped.cracked->pieces)
    if (!piece.dropped && fragments.in_pieces(piece.part)) crack.pieces.push_back(piece);
  crack.fragments = crack.pieces.size();
}

// Carved and broken: the part is closed around what went, then that surface is parted along the cracks, whose
// faces lie elsewhere (between elements, not voxels).
CrackedSurface part_carved(Body& body, const Broken& broken, const CrackOptions& options) {
  CrackedSurface closed = close_carved(body, whole_parts(body), options.mode);
  for (std::uint32_t part = 0; part < body.parts.size(); ++part)
    if (part >= closed.part_piece.size() || closed.pieces[closed.part_piece[part]].part != part)
      throw InputError("--crack: nothing is left of the surface of part \"" + body.parts[part].name + "\"");
  std::vector<std::uint32_t> no_offsets, no_cells;  // the cells under the polygons are those of others
  const Loan surface(body.surface, closed.surface);
  const Loan offsets(body.surface_cell_offsets, no_offsets), cells(body.surface_cells, no_cells);
  return part_surface(body, broken.fragments, broken.parted, options, std::move(closed.seats),
                      std::move(closed.shifts));
}

}  // namespace

bool may_be_broken(const Body& body) {
  const bool centre = std::any_of(body.parts.begin(), body.parts.end(),
                                  [](const Part& part) { return part.placement == Placement::centre; });
  return centre || body.notes.count(kCarvedNote) > 0 ||
         std::find(body.broken.begin(), body.broken.end(), 1) != body.broken.end();
}

MappedPart map_part(Body& body, const MapOptions& options, const CrackOptions& crack, Progress& progress,
                    const Binding* known) {
  MappedPart mapped;
  if (crack.mode != CrackMode::keep && is_carved_cleanly(body)) {
    map_carved(body, options, crack.mode, mapped, progress);
    return mapped;
  }
  if (crack.mode == CrackMode::keep) warn_of_carved(body, progress);
  std::optional<Broken> broken;
  if (may_be_broken(body)) broken.emplace(body);
  const std::size_t pieces = broken ? broken->pieces() : 0;
  // Broken cells may part nothing, and what was carved has to go all the same.
  const bool carved = crack.mode != CrackMode::keep && body.notes.count(kCarvedNote) > 0;
  const bool anything = carved || pieces > 0 || (broken && broken->cracked_inside());
  if (anything && crack.mode != CrackMode::keep) {
    progress.update(0, "parting the surface");
    mapped.cracked = body.notes.count(kCarvedNote) > 0
                         ? part_carved(body, *broken, crack)
                         : part_surface(body, broken->fragments, broken->parted, crack);
    map_pieces(body, broken->fragments, options, crack.mode, mapped, progress);
    if (pieces > 0) mapped.report.crack.pieces = mapped.cracked->pieces;
  } else {
    if (known) {
      mapped.result = map_state(*known, body);
      complete(body, options, mapped.result);
    } else {
      mapped.result = map_surface(body, options, progress);
    }
    mapped.report = report(body, mapped.result);
    if (anything)
      mapped.report.crack.spanning_triangles =
          spanning_triangles(body, mapped.result, broken->fragments, &broken->parted);
  }
  mapped.report.crack.mode = crack.mode;
  mapped.report.crack.fragments = pieces;
  for (std::uint32_t part = 0; broken && part < body.parts.size(); ++part)
    mapped.report.crack.cracked_parts += broken->parted.inside(part);
  return mapped;
}

}  // namespace flexel
