// A whole surface is mapped as it is; a surface that was cut along cracks replaces the body's own while it is
// mapped.
#include "mapping/map_part.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/program/share_scope.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/part/topology.h"
#include "mapping/crack/crack_carved.h"
#include "mapping/loan.h"
#include "mapping/methods/map_surface.h"
#include "mapping/report/report.h"

namespace flexel::mapping {
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

// The fragments, and the pairs that a crack parted.
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
    mapped.result = map_surface(body, options, cracked.anchors, progress);
    for (std::size_t s = 0; s < cracked.shifts.size(); ++s) {
      vertices[cracked.shifts[s].vertex] = at_rest[s];
      mapped.result.displacement[cracked.shifts[s].vertex] += cracked.shifts[s].by;
    }
    mapped.report = report(body, mapped.result, true);
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

// What [[event]] carve took away leaves its surface behind (docs/reference/events.md).
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
  return part_surface(body, broken.fragments, broken.parted, options, std::move(closed.anchors),
                      std::move(closed.shifts));
}

}  // namespace

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
    const double map_share = options.check_intersection ? 0.75 : 0.2;  // of the time
    if (known) {
      mapped.result = map_state(*known, body);
      complete(body, options, mapped.result);
    } else {
      const ShareScope mapping(progress, 0, map_share);
      mapped.result = map_surface(body, options, progress);
    }
    const ShareScope reporting(progress, map_share, 1, "checking");
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

}  // namespace flexel::mapping
