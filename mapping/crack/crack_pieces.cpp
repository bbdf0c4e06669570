// A vertex of the body's surface lies in one box, so in one piece, and stays one vertex. A point on a cut
// becomes a vertex of each piece that it bounds. Where a piece touches itself there, or has a crack that ends
// inside it, the polygons around the point are grouped by the edges that they share, as far as they bound the
// same matter, and each group gets a vertex. At the end of a crack both sides are in one group.
#include "mapping/crack/crack_pieces.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/disjoint_sets.h"
#include "formats/part/topology.h"

namespace flexel::mapping {

PieceBuilder::PieceBuilder(const Body& body, const Components& fragments, const CrackOptions& options,
                           VertexAnchors anchors, std::vector<CrackedSurface::Shift> shifts)
    : body_(body), fragments_(fragments), options_(options) {
  Surface& surface = result_.surface;
  surface.vertices = body.surface.vertices;
  surface.polygon_offsets.push_back(0);
  surface.sources = body.surface.sources;
  // The file's bytes have other polygons.
  for (SurfaceSource& source : surface.sources) source.bytes.clear();
  result_.anchors = std::move(anchors);
  result_.shifts = std::move(shifts);
  std::fill(result_.anchors.referenced.begin(), result_.anchors.referenced.end(), std::uint8_t{0});
  seen_.assign(surface.vertices.size(), kNoBox);
  part_of_.assign(fragments.list.size(), kNoBox);
  for (std::uint32_t f = 0; f < fragments.list.size(); ++f) {
    const std::uint32_t part = fragments.list[f].part;
    CrackPiece piece;
    piece.name = body.surface.parts[part].name;
    if (fragments.in_pieces(part)) piece.name += fmt::format("-{}", f - fragments.offset[part] + 1);
    piece.part = part;
    piece.fragment = f;
    piece.elements = fragments.list[f].elements;
    piece.debris = fragments.debris(f);
    result_.pieces.push_back(piece);
  }
}

std::uint32_t PieceBuilder::face(std::uint32_t fragment, std::uint32_t source) {
  Surface& surface = result_.surface;
  if (part_of_[fragment] == kNoBox) {
    part_of_[fragment] = static_cast<std::uint32_t>(surface.parts.size());
    surface.parts.push_back({result_.pieces[fragment].name});
    surface.part_source.push_back(body_.surface.part_source[result_.pieces[fragment].part]);
    result_.part_piece.push_back(fragment);
  }
  const std::uint32_t part = part_of_[fragment];
  const std::uint32_t of = source == kNoPolygon ? kNoPolygon : body_.surface.polygon_face[source];
  const auto [it, fresh] =
      face_of_.try_emplace(std::uint64_t{part} << 32 | of, static_cast<std::uint32_t>(surface.faces.size()));
  if (fresh) surface.faces.push_back({of == kNoPolygon ? "crack" : body_.surface.faces[of].name, part});
  return it->second;
}

void PieceBuilder::add_polygon(std::uint32_t fragment, std::uint32_t source,
                               std::span<const std::uint32_t> corners) {
  Surface& surface = result_.surface;
  surface.polygon_face.push_back(face(fragment, source));
  surface.polygon_vertices.insert(surface.polygon_vertices.end(), corners.begin(), corners.end());
  surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
  source_polygon_.push_back(source);
  for (const std::uint32_t v : corners) result_.anchors.referenced[v] = 1;
}

void PieceBuilder::add_whole(std::uint32_t part) {
  for (std::uint32_t p = 0; p < body_.surface.polygon_count(); ++p)
    if (body_.surface.polygon_part(p) == part)
      add_polygon(fragments_.offset[part], p, body_.surface.polygon(p));
}

void PieceBuilder::Holder::operator+=(const Holder& other) {
  element = std::min(element, other.element);
  centre += other.centre;
  boxes += other.boxes;
}

// The boxes around a node that hold the matter under one of the polygons around it.
PieceBuilder::Holder PieceBuilder::holder(const CrackMesh& mesh, const CrackPolygon& polygon,
                                          std::uint32_t node) const {
  BoxRange around;
  for (int axis = 0; axis < 3; ++axis) {
    const int on = mesh.plane(node, axis);
    const int low = on == kNoPlane ? mesh.boxes().box_of(axis, mesh.u(node)[axis]) : on;
    around.low[axis] = std::clamp(low, polygon.range.low[axis], polygon.range.high[axis]);
    around.high[axis] =
        std::clamp(on == kNoPlane ? low : on + 1, polygon.range.low[axis], polygon.range.high[axis]);
  }
  Holder found;
  Index3 index{};
  for (index[2] = around.low[2]; index[2] <= around.high[2]; ++index[2])
    for (index[1] = around.low[1]; index[1] <= around.high[1]; ++index[1])
      for (index[0] = around.low[0]; index[0] <= around.high[0]; ++index[0]) {
        const std::uint32_t box = mesh.boxes().find(index);
        if (box == kNoBox) continue;
        const std::uint32_t element = mesh.boxes().owner_in(box, polygon.fragment);
        if (element != kNoBox) found += {element, Vec3(index[0], index[1], index[2]), 1};
      }
  return found;
}

std::uint32_t PieceBuilder::add_vertex(const CrackMesh& mesh, std::uint32_t node, std::uint32_t element) {
  const CrackNode& from = mesh.nodes()[node - seen_.size()];
  Surface& surface = result_.surface;
  surface.vertices.push_back(from.world);
  source_vertex_.push_back({from.from, from.weight});
  result_.anchors.anchor.push_back(
      anchor_at_element(body_, fragments_.list[fragments_.of[element]].part, element, from.world));
  result_.anchors.referenced.push_back(0);
  return static_cast<std::uint32_t>(surface.vertices.size() - 1);
}

// A vertex of the body's surface keeps its anchor, unless that is in another fragment or beyond a
// crack: then with the owner of its box.
void PieceBuilder::place_vertex(const CrackMesh& mesh, const CrackPolygon& polygon, std::uint32_t vertex) {
  if (seen_[vertex] != kNoBox) return;
  seen_[vertex] = polygon.fragment;
  const VertexAnchor& anchor = result_.anchors.anchor[vertex];
  const std::uint32_t origin =
      anchor.in_cell ? body_.cell_elements[anchor.owner][anchor.octant] : anchor.owner;
  const std::uint32_t element = holder(mesh, polygon, vertex).element;
  if (fragments_.of[origin] == polygon.fragment && !mesh.boxes().parted(origin, element)) return;
  if (element != kNoBox)
    result_.anchors.anchor[vertex] = anchor_at_element(body_, fragments_.list[polygon.fragment].part, element,
                                                       body_.surface.vertices[vertex]);
}

namespace {

// Of a triangle.
double least_height(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double longest =
      std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  return longest > 0 ? (b - a).cross(c - a).norm() / longest : 0;
}

// On which side of a plane a polygon with an edge on it lies.
bool is_above(const CrackPolygon& polygon, int axis, int on) {
  return polygon.range.low[axis] > on;
}

constexpr int kUnknown = -1;

// Of the polygons that share the edge from `a` to `b`, those with equal numbers bound the same matter there.
int sector(const CrackMesh& mesh, std::uint32_t a, std::uint32_t b, const CrackPolygon& polygon) {
  const CrackBoxes& boxes = mesh.boxes();
  std::array<int, 3> on{kNoPlane, kNoPlane, kNoPlane};
  int planes = 0, axis = 0, along = 0;
  for (int k = 0; k < 3; ++k) {
    const int plane = mesh.plane(a, k);
    if (plane == kNoPlane || plane != mesh.plane(b, k)) {
      along = k;
      continue;
    }
    on[k] = plane;
    axis = k;
    ++planes;
  }
  if (planes == 0) return 0;
  Index3 low = boxes.box_of(Vec3(0.5 * (mesh.u(a) + mesh.u(b))));
  if (planes == 1) {
    low[axis] = on[axis];
    switch (boxes.face(axis, low)) {
      case CrackBoxes::Face::whole:
        return 0;
      case CrackBoxes::Face::mixed:
        return kUnknown;
      default:
        return is_above(polygon, axis, on[axis]);
    }
  }
  if (planes > 2) return kUnknown;
  const int p = along == 0 ? 1 : 0, q = along == 2 ? 1 : 2;
  const auto sectors = boxes.sectors(along, on[p], on[q], low[along]);
  if (!sectors) return kUnknown;
  return (*sectors)[is_above(polygon, p, on[p]) + 2 * is_above(polygon, q, on[q])];
}

// The side of the plane of `axis` at the node on which a polygon bounds a crack: 1 above, -1 below; 0 where
// it is no wall there, nor meets one in an edge that ends at the node.
int side_of_wall(const CrackMesh& mesh, std::uint32_t node, std::uint32_t previous, std::uint32_t next,
                 const CrackPolygon& polygon, int axis) {
  const int on = mesh.plane(node, axis);
  if (on == kNoPlane) return 0;
  const auto lies_on = [&](std::uint32_t other) { return mesh.plane(other, axis) == on; };
  const auto along_crack = [&](std::uint32_t other) {
    if (!lies_on(other)) return false;
    Index3 low = mesh.boxes().box_of(Vec3(0.5 * (mesh.u(node) + mesh.u(other))));
    low[axis] = on;
    return mesh.boxes().face(axis, low) != CrackBoxes::Face::whole;
  };
  const bool wall = polygon.polygon == kNoPolygon;
  const bool bounds = wall ? lies_on(previous) && lies_on(next) : along_crack(previous) || along_crack(next);
  return !bounds ? 0 : is_above(polygon, axis, on) ? 1 : -1;
}

}  // namespace

DisjointSets PieceBuilder::fans_around(const CrackMesh& mesh, std::span<const Corner> around) {
  DisjointSets fans(around.size());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> spokes;  // the edge's other end, corner
  for (std::uint32_t k = 0; k < around.size(); ++k) {
    spokes.emplace_back(mesh.welded(around[k].previous), k);
    spokes.emplace_back(mesh.welded(around[k].next), k);
  }
  std::sort(spokes.begin(), spokes.end());
  for (std::size_t begin = 0, end = 0; begin < spokes.size(); begin = end) {
    for (end = begin; end < spokes.size() && spokes[end].first == spokes[begin].first;) ++end;
    for (std::size_t a = begin; a < end; ++a)
      for (std::size_t b = a + 1; b < end; ++b) {
        const CrackPolygon &one = *around[spokes[a].second].polygon,
                           &other = *around[spokes[b].second].polygon;
        const int mine = sector(mesh, around[0].node, spokes[a].first, one);
        const bool same_box = one.range.low == other.range.low && one.range.high == other.range.high;
        if (mine != kUnknown ? mine == sector(mesh, around[0].node, spokes[b].first, other)
                             : end - begin == 2 || same_box)
          fans.unite(spokes[a].second, spokes[b].second);
      }
  }
  return fans;
}

// `around`: all corners at one node in one fragment.
void PieceBuilder::place_fans(const CrackMesh& mesh, std::span<const Corner> around,
                              std::vector<std::uint32_t>& vertex) {
  DisjointSets fans = fans_around(mesh, around);
  // Away from the walls, once for each side of a plane.
  std::vector<Vec3> towards(around.size()), above(around.size(), Vec3::Zero()), below = above;
  for (std::uint32_t k = 0; k < around.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      if (const int side = side_of_wall(mesh, around[k].node, around[k].previous, around[k].next,
                                        *around[k].polygon, axis);
          side != 0)
        (side > 0 ? above : below)[fans.root(k)][axis] = 1;
  for (std::uint32_t k = 0; k < around.size(); ++k) towards[k] = above[k] - below[k];
  std::vector<Holder> held(around.size());
  std::vector<double> room(around.size(), kDrawnApart);  // how far a fan's vertex may be drawn, in spacings
  for (std::uint32_t k = 0; k < around.size(); ++k) {
    const Corner& corner = around[k];
    const std::uint32_t root = fans.root(k);
    held[root] += holder(mesh, *corner.polygon, corner.node);
    room[root] = std::min(
        room[root], 0.2 * least_height(mesh.u(corner.previous), mesh.u(corner.node), mesh.u(corner.next)));
  }
  std::vector<std::uint32_t> added(around.size(), kNoBox);
  int count = 0;
  for (std::uint32_t k = 0; k < around.size(); ++k) count += fans.root(k) == k;
  for (std::uint32_t k = 0; k < around.size(); ++k) {
    const std::uint32_t root = fans.root(k);
    if (root == k) {
      added[k] = add_vertex(mesh, around[k].node, held[k].element);
      Vec3 inward = towards[k];
      // All round the end of a crack: towards its own matter.
      if (inward.isZero(0)) inward = held[k].centre / held[k].boxes - mesh.u(around[k].node);
      for (int axis = 0; axis < 3; ++axis)
        if (mesh.plane(around[k].node, axis) == kNoPlane) inward[axis] = 0;
      if (count > 1 && options_.mode == CrackMode::cap && inward.norm() > 0) {
        const Lattice& lattice = body_.parts[result_.pieces[around[k].fragment].part].lattice;
        result_.shifts.push_back(
            {added[k], lattice.axes * (room[k] * inward.normalized()).cwiseProduct(lattice.spacing)});
      }
    }
    vertex[around[k].slot] = added[root];
  }
}

void PieceBuilder::add_pieces(const CrackMesh& mesh, const CrackPolygons& polygons) {
  std::vector<std::uint32_t> vertex(polygons.corners.size(), kNoBox);
  std::vector<Corner> corners;
  for (const CrackPolygon& polygon : polygons.list)
    for (std::uint32_t slot = polygon.begin; slot < polygon.end; ++slot) {
      const std::uint32_t node = polygons.corners[slot];
      if (mesh.is_vertex(node)) {
        place_vertex(mesh, polygon, node);
        vertex[slot] = node;
      } else {
        corners.push_back({polygon.fragment, node, slot,
                           polygons.corners[slot > polygon.begin ? slot - 1 : polygon.end - 1],
                           polygons.corners[slot + 1 < polygon.end ? slot + 1 : polygon.begin], &polygon});
      }
    }
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return std::array{a.fragment, a.node, a.slot} < std::array{b.fragment, b.node, b.slot};
  });
  for (std::size_t begin = 0, end = 0; begin < corners.size(); begin = end) {
    for (end = begin; end < corners.size() && corners[end].fragment == corners[begin].fragment &&
                      corners[end].node == corners[begin].node;)
      ++end;
    place_fans(mesh, {corners.data() + begin, end - begin}, vertex);
  }
  // Pieces in order, so that their parts of the surface are too.
  std::vector<const CrackPolygon*> order;
  for (const CrackPolygon& polygon : polygons.list) order.push_back(&polygon);
  std::stable_sort(order.begin(), order.end(),
                   [](const CrackPolygon* a, const CrackPolygon* b) { return a->fragment < b->fragment; });
  for (const CrackPolygon* polygon : order)
    add_polygon(polygon->fragment, polygon->polygon,
                {vertex.data() + polygon->begin, polygon->end - polygon->begin});
}

// New vertices get attributes between those around them, walls the mean.
void PieceBuilder::fill_columns() {
  const auto mean = [](const Column& column, int component) {
    double sum = 0;
    const std::size_t rows = column.values.size() / static_cast<std::size_t>(column.components);
    for (std::size_t r = 0; r < rows; ++r)
      sum +=
          column
              .values[r * static_cast<std::size_t>(column.components) + static_cast<std::size_t>(component)];
    return rows > 0 ? sum / static_cast<double>(rows) : 0;
  };
  for (const auto& [name, column] : body_.surface.vertex_columns) {
    Column& to = result_.surface.vertex_columns[name] = column;
    const auto at = [&from = column](std::uint32_t v, int c) {
      return from.values[v * static_cast<std::size_t>(from.components) + static_cast<std::size_t>(c)];
    };
    std::vector<double> means;
    for (int c = 0; c < column.components; ++c) means.push_back(mean(column, c));
    for (const Source& source : source_vertex_)
      for (int c = 0; c < column.components; ++c) {
        double value = 0;
        for (int k = 0; k < 3; ++k) value += source.weight[k] * at(source.from[k], c);
        if (name == kColorColumn) value = std::clamp(value, 0.0, 1.0);
        to.values.push_back(source.weight.isZero(0) ? means[c] : value);
      }
  }
  for (const auto& [name, column] : body_.surface.polygon_columns) {
    Column& to = result_.surface.polygon_columns[name];
    to.components = column.components;
    std::vector<double> means;
    for (int c = 0; c < column.components; ++c) means.push_back(mean(column, c));
    for (const std::uint32_t p : source_polygon_)
      for (int c = 0; c < column.components; ++c)
        to.values.push_back(p == kNoPolygon ? means[c]
                                            : column.values[p * static_cast<std::size_t>(column.components) +
                                                            static_cast<std::size_t>(c)]);
  }
}

CrackedSurface PieceBuilder::take() {
  fill_columns();
  // Another part may have the name of a piece.
  make_part_names_unique(result_.surface, "part");
  for (std::size_t part = 0; part < result_.part_piece.size(); ++part)
    result_.pieces[result_.part_piece[part]].name = result_.surface.parts[part].name;
  return std::move(result_);
}

}  // namespace flexel::mapping
