// Puts the cut triangles and walls of all parts together to one surface whose parts are the pieces.
#pragma once
#include "base/disjoint_sets.h"
#include "formats/lattice/fragments_of_body.h"
#include "mapping/crack/crack_caps.h"
#include "mapping/crack/cracked_surface.h"

namespace flexel::mapping {

// Polygons of the pieces of one part; corners are nodes of its CrackMesh.
struct CrackPolygon {
  std::uint32_t fragment = 0;
  std::uint32_t polygon = 0;  // of the body's surface that it is, or is cut from; kNoPolygon: a wall
  std::uint32_t begin = 0, end = 0;
  BoxRange range;  // boxes that it lies in
};
constexpr std::uint32_t kNoPolygon = 0xffffffffu;
struct CrackPolygons {
  std::vector<CrackPolygon> list;
  std::vector<std::uint32_t> corners;
  [[nodiscard]] std::span<const std::uint32_t> of(const CrackPolygon& polygon) const {
    return {corners.data() + polygon.begin, polygon.end - polygon.begin};
  }
};

// Polygons none of whose triangles was cut come as they were, others as triangles. `polygon_of`: (triangles
// of the mesh).
[[nodiscard]] CrackPolygons gather_polygons(const Surface& surface, const CrackMesh& mesh,
                                            const std::vector<std::uint32_t>& polygon_of,
                                            const std::vector<CrackCap>& caps);

// Every edge is run through as often one way as the other, in each fragment.
[[nodiscard]] bool is_closed(const CrackMesh& mesh, const CrackPolygons& polygons);

// Takes debris out of the surface. Throws InputError: nothing else is there.
void drop_debris(CrackedSurface& cracked);

class PieceBuilder {
 public:
  // `anchors`, `shifts`: of the vertices of the body's surface.
  PieceBuilder(const Body& body, const Components& fragments, const CrackOptions& options,
               VertexAnchors anchors, std::vector<CrackedSurface::Shift> shifts);
  // A part that did not break.
  void add_whole(std::uint32_t part);
  void add_pieces(const CrackMesh& mesh, const CrackPolygons& polygons);
  [[nodiscard]] CrackedSurface take();

 private:
  // A polygon around a point on a plane.
  struct Corner {
    std::uint32_t fragment, node, slot, previous, next;
    const CrackPolygon* polygon;
  };
  // What the boxes that hold the matter at a node say.
  struct Holder {
    std::uint32_t element = kNoBox;  // the lowest owner
    Vec3 centre = Vec3::Zero();      // sum over the boxes, u
    int boxes = 0;
    void operator+=(const Holder& other);
  };
  [[nodiscard]] Holder holder(const CrackMesh& mesh, const CrackPolygon& polygon, std::uint32_t node) const;
  [[nodiscard]] std::uint32_t add_vertex(const CrackMesh& mesh, std::uint32_t node, std::uint32_t element);
  void place_vertex(const CrackMesh& mesh, const CrackPolygon& polygon, std::uint32_t vertex);
  // Corners at one node that hang together by edges, as sets.
  [[nodiscard]] static DisjointSets fans_around(const CrackMesh& mesh, std::span<const Corner> around);
  void place_fans(const CrackMesh& mesh, std::span<const Corner> around, std::vector<std::uint32_t>& vertex);
  void add_polygon(std::uint32_t fragment, std::uint32_t source, std::span<const std::uint32_t> corners);
  [[nodiscard]] std::uint32_t face(std::uint32_t fragment, std::uint32_t source);
  void fill_columns();

  const Body& body_;
  const Components& fragments_;
  CrackOptions options_;
  CrackedSurface result_;
  std::vector<std::uint32_t> seen_;     // (vertices of the body's surface) fragment, or kNoBox
  std::vector<std::uint32_t> part_of_;  // (fragments) part of the surface, or kNoBox
  std::unordered_map<std::uint64_t, std::uint32_t> face_of_;  // by part of the surface and face of the body
  std::vector<std::uint32_t> source_polygon_;                 // (polygons) kNoPolygon: a wall
  struct Source {
    std::array<std::uint32_t, 3> from;
    Vec3 weight;
  };
  std::vector<Source> source_vertex_;  // (new vertices)
};

}  // namespace flexel::mapping
