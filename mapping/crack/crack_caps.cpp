// The part of a square inside the part is bounded by the surface's cut lines and by those stretches of its
// sides that are inside, which the parity of crossings along the whole lattice line decides. Neighbours share
// both, so walls meet each other and the surface in the same points.
#include "mapping/crack/crack_caps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <map>

#include "base/parallel.h"
#include "mapping/crack/crack_triangulate.h"

namespace flexel::mapping {
namespace {

std::array<int, 2> other_axes(int axis) {
  return axis == 0 ? std::array{1, 2} : axis == 1 ? std::array{0, 2} : std::array{0, 1};
}

// The four sides of a square.
std::array<std::array<int, 4>, 4> sides(const CrackBoxes::Square& square) {
  std::array<std::array<int, 4>, 4> result{};
  int side = 0;
  for (const int along : other_axes(square.axis)) {
    const auto [p, q] = other_axes(along);
    const int across = p == square.axis ? q : p;
    for (int step = -1; step < 1; ++step) {
      Index3 plane{};
      plane[square.axis] = square.low[square.axis];
      plane[across] = square.low[across] + step;
      result[side++] = {along, plane[p], plane[q], square.low[along]};
    }
  }
  return result;
}

}  // namespace

void CrackEdges::list_places(const CrackBoxes& boxes, bool inside_only) {
  for (const CrackBoxes::Square& square : boxes.squares())
    if (!inside_only || boxes.face(square.axis, square.low) == CrackBoxes::Face::inside)
      for (const Place& side : sides(square)) places_.push_back(side);
  std::sort(places_.begin(), places_.end());
  places_.erase(std::unique(places_.begin(), places_.end()), places_.end());
  for (const Place& place : places_) {
    const Line line{place[0], place[1], place[2]};
    if (lines_.empty() || lines_.back() != line) lines_.push_back(line);
  }
  pierces_.resize(lines_.size());
}

void CrackEdges::pierce(const CrackMesh& mesh) {
  const CrackBoxes& boxes = mesh.boxes();
  for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t) {
    const auto& corner = mesh.triangles()[t];
    const Vec3 &a = mesh.u(corner[0]), &b = mesh.u(corner[1]), &c = mesh.u(corner[2]);
    const Vec3 low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    const Vec3 normal = (b - a).cross(c - a);
    for (int along = 0; along < 3; ++along) {
      const auto [p, q] = other_axes(along);
      const int q_low = boxes.box_of(q, low[q]) - 1, q_high = boxes.box_of(q, high[q]) + 1;
      for (int i = boxes.box_of(p, low[p]) - 1; i <= boxes.box_of(p, high[p]); ++i) {
        auto line = std::lower_bound(lines_.begin(), lines_.end(), Line{along, i, q_low});
        if (line == lines_.end() || *line > Line{along, i, q_high}) continue;
        const auto ends = mesh.crossing(t, p, i);
        if (!ends) continue;
        for (; line != lines_.end() && *line <= Line{along, i, q_high}; ++line) {
          const double at = boxes.plane(q, (*line)[2]);
          if ((ends->u[0][q] >= at) == (ends->u[1][q] >= at)) continue;
          const double s = (at - ends->u[0][q]) / (ends->u[1][q] - ends->u[0][q]);
          pierces_[static_cast<std::size_t>(line - lines_.begin())].push_back(
              {ends->u[0][along] + s * (ends->u[1][along] - ends->u[0][along]), t, normal[along] > 0});
        }
      }
    }
  }
}

void CrackEdges::make_stretches(CrackMesh& mesh, std::size_t number) {
  const Place& place = places_[number];
  const auto [p, q] = other_axes(place[0]);
  const int along = place[0];
  const CrackBoxes& boxes = mesh.boxes();
  const std::size_t line = static_cast<std::size_t>(
      std::lower_bound(lines_.begin(), lines_.end(), Line{place[0], place[1], place[2]}) - lines_.begin());
  const double low = boxes.plane(along, place[3] - 1), high = boxes.plane(along, place[3]);
  std::array<int, 3> planes{};
  planes[p] = place[1];
  planes[q] = place[2];
  const auto corner = [&](int plane_along) {
    planes[along] = plane_along;
    const auto pack = [](int i) { return static_cast<std::uint64_t>(i + (1 << 20)); };
    const std::uint64_t key = pack(planes[2]) << 42 | pack(planes[1]) << 21 | pack(planes[0]);
    const auto known = corner_.find(key);
    if (known != corner_.end()) return known->second;
    const Vec3 u(boxes.plane(0, planes[0]), boxes.plane(1, planes[1]), boxes.plane(2, planes[2]));
    return corner_[key] = mesh.add_node(u, planes);
  };
  bool inside = false;
  std::vector<std::uint32_t> ends;
  for (const Pierce& pierce : pierces_[line]) {
    if (pierce.at >= high) break;
    if (pierce.at < low) {
      inside = !inside;
      continue;
    }
    if (ends.empty() && inside) ends.push_back(corner(place[3] - 1));
    inside = !inside;
    ends.push_back(mesh.pierce_node(pierce.triangle, p, place[1], q, place[2]));
  }
  if (ends.empty() && inside) ends.push_back(corner(place[3] - 1));
  if (inside) ends.push_back(corner(place[3]));
  const bool halve = !ends.empty() && boxes.touches_itself(along, place[1], place[2], place[3]);
  for (std::size_t k = 0; k + 1 < ends.size(); k += 2) {
    if (halve) {
      // A point of its own lets each of the piece's two sides have an edge of its own.
      std::array<int, 3> plane{kNoPlane, kNoPlane, kNoPlane};
      plane[p] = place[1];
      plane[q] = place[2];
      const std::uint32_t middle = mesh.add_node(0.5 * (mesh.u(ends[k]) + mesh.u(ends[k + 1])), plane);
      stretches_.push_back({ends[k], middle});
      stretches_.push_back({middle, ends[k + 1]});
    } else {
      stretches_.push_back({ends[k], ends[k + 1]});
    }
  }
}

void CrackEdges::find_ends(CrackMesh& mesh) {
  list_places(mesh.boxes(), true);
  pierce(mesh);
  for (const Place& place : places_) {
    const auto [p, q] = other_axes(place[0]);
    const double low = mesh.boxes().plane(place[0], place[3] - 1),
                 high = mesh.boxes().plane(place[0], place[3]);
    const auto line = std::lower_bound(lines_.begin(), lines_.end(), Line{place[0], place[1], place[2]});
    for (const Pierce& pierce : pierces_[static_cast<std::size_t>(line - lines_.begin())])
      if (pierce.at >= low && pierce.at < high)
        (void)mesh.pierce_node(pierce.triangle, p, place[1], q, place[2]);
  }
}

CapOutcome CrackEdges::find(CrackMesh& mesh) {
  list_places(mesh.boxes(), false);
  pierce(mesh);
  for (std::vector<Pierce>& along : pierces_) {
    std::sort(along.begin(), along.end(), [](const Pierce& a, const Pierce& b) {
      return a.at != b.at ? a.at < b.at : a.triangle < b.triangle;
    });
    if (along.size() % 2 != 0) return CapOutcome::degenerate;
    for (std::size_t k = 0; k < along.size(); ++k)
      if (along[k].leaves != (k % 2 == 1)) return CapOutcome::crosses_itself;
  }
  offset_.push_back(0);
  for (std::size_t place = 0; place < places_.size(); ++place) {
    make_stretches(mesh, place);
    offset_.push_back(static_cast<std::uint32_t>(stretches_.size()));
  }
  return CapOutcome::done;
}

std::span<const std::array<std::uint32_t, 2>> CrackEdges::of(int along, int first_plane, int second_plane,
                                                             int box) const {
  const Place place{along, first_plane, second_plane, box};
  const auto at = std::lower_bound(places_.begin(), places_.end(), place);
  if (at == places_.end() || *at != place) return {};
  const std::size_t number = static_cast<std::size_t>(at - places_.begin());
  return {stretches_.data() + offset_[number], offset_[number + 1] - offset_[number]};
}

namespace {

using Edge = std::array<std::uint32_t, 2>;

struct Cut {
  std::uint32_t square;
  Edge edge;
};

std::size_t number_of(const std::vector<CrackBoxes::Square>& squares, int axis, const Index3& low) {
  const auto key = [](const CrackBoxes::Square& s) {
    return std::array{s.axis, s.low[2], s.low[1], s.low[0]};
  };
  const CrackBoxes::Square wanted{axis, low};
  const auto at = std::lower_bound(squares.begin(), squares.end(), wanted,
                                   [&](const auto& a, const auto& b) { return key(a) < key(b); });
  return static_cast<std::size_t>(at - squares.begin());
}

// The surface's cuts along the squares, by square.
std::vector<Cut> find_cuts(const CrackMesh& mesh) {
  const CrackBoxes& boxes = mesh.boxes();
  std::vector<Cut> cuts;
  for (const CrackBit& bit : mesh.bits()) {
    if (!bit.changed) continue;
    const auto corners = mesh.corners(bit);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const std::uint32_t from = corners[k], to = corners[(k + 1) % corners.size()];
      for (int axis = 0; axis < 3; ++axis) {
        const int on = mesh.plane(from, axis);
        if (on == kNoPlane || on != mesh.plane(to, axis) || bit.range.high[axis] != on) continue;
        Index3 low = boxes.box_of(Vec3(0.5 * (mesh.u(from) + mesh.u(to))));
        low[axis] = on;
        if (boxes.is_square(axis, low))
          cuts.push_back({static_cast<std::uint32_t>(number_of(boxes.squares(), axis, low)), {from, to}});
      }
    }
  }
  std::stable_sort(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) { return a.square < b.square; });
  return cuts;
}

// Triangles of a square, counter-clockwise seen from above. False: degenerate.
bool fill(const CrackMesh& mesh, const CrackBoxes::Square& square, std::vector<Edge> edges,
          std::vector<CrackCap>& caps) {
  if (edges.empty()) return true;
  std::vector<std::uint32_t> nodes;
  for (const Edge& edge : edges) nodes.insert(nodes.end(), edge.begin(), edge.end());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  for (Edge& edge : edges)
    for (std::uint32_t& node : edge)
      node = static_cast<std::uint32_t>(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
  const int b = (square.axis + 1) % 3, c = (square.axis + 2) % 3;
  std::vector<Eigen::Vector2d> points;
  for (const std::uint32_t node : nodes) points.emplace_back(mesh.u(node)[b], mesh.u(node)[c]);
  const auto triangles = triangulate_inside(points, edges);
  if (!triangles) return false;
  for (const auto& triangle : *triangles)
    caps.push_back({0, square.low, {nodes[triangle[0]], nodes[triangle[1]], nodes[triangle[2]]}});
  return true;
}

}  // namespace

namespace {

// A node that the sides of a crack may share, at its end.
bool may_be_shared(const CrackMesh& mesh, std::uint32_t node) {
  int planes = 0;
  for (int axis = 0; axis < 3; ++axis) planes += mesh.plane(node, axis) != kNoPlane;
  return planes > 1;
}

// Halves the edges between triangles of a wall whose ends may both be shared: else both sides would have the
// same edge, or the same triangle.
void halve_inner_edges(CrackMesh& mesh, const CrackBoxes::Square& square, std::vector<CrackCap>& caps) {
  std::map<Edge, std::pair<int, std::uint32_t>> edges;  // uses, node in the middle
  const auto key = [](std::uint32_t a, std::uint32_t b) { return Edge{std::min(a, b), std::max(a, b)}; };
  for (const CrackCap& cap : caps)
    for (int k = 0; k < 3; ++k) ++edges[key(cap.corners[k], cap.corners[(k + 1) % 3])].first;
  std::array<int, 3> plane{kNoPlane, kNoPlane, kNoPlane};
  plane[square.axis] = square.low[square.axis];
  for (auto& [edge, of] : edges)
    of.second = of.first == 2 && may_be_shared(mesh, edge[0]) && may_be_shared(mesh, edge[1])
                    ? mesh.add_node(0.5 * (mesh.u(edge[0]) + mesh.u(edge[1])), plane)
                    : kNoBox;
  std::vector<CrackCap> halved;
  for (const CrackCap& cap : caps) {
    // Around the triangle, beginning at a middle: a fan from there has every middle in a triangle's corner.
    std::vector<std::uint32_t> around;
    std::size_t first = 0;
    for (int k = 0; k < 3; ++k) {
      around.push_back(cap.corners[k]);
      const std::uint32_t middle = edges[key(cap.corners[k], cap.corners[(k + 1) % 3])].second;
      if (middle == kNoBox) continue;
      first = around.size();
      around.push_back(middle);
    }
    std::rotate(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(first), around.end());
    for (std::size_t k = 1; k + 1 < around.size(); ++k)
      halved.push_back({0, square.low, {around[0], around[k], around[k + 1]}});
  }
  caps = std::move(halved);
}

}  // namespace

CapOutcome make_caps(CrackMesh& mesh, const CrackEdges& edges, std::vector<CrackCap>& caps) {
  const CrackBoxes& boxes = mesh.boxes();
  const std::vector<Cut> cuts = find_cuts(mesh);
  std::vector<std::vector<CrackCap>> found(boxes.squares().size());
  std::atomic<bool> degenerate{false};
  parallel_for_each(
      found.size(),
      [&](std::size_t s) {
        const CrackBoxes::Square& square = boxes.squares()[s];
        std::vector<Edge> around;
        auto cut = std::lower_bound(cuts.begin(), cuts.end(), s,
                                    [](const Cut& c, std::size_t number) { return c.square < number; });
        for (; cut != cuts.end() && cut->square == s; ++cut) around.push_back(cut->edge);
        for (const auto& side : sides(square)) {
          const auto stretches = edges.of(side[0], side[1], side[2], side[3]);
          around.insert(around.end(), stretches.begin(), stretches.end());
        }
        if (!fill(mesh, square, std::move(around), found[s])) degenerate = true;
      },
      64);
  if (degenerate) return CapOutcome::degenerate;
  for (std::size_t s = 0; s < found.size(); ++s) {
    const CrackBoxes::Square& square = boxes.squares()[s];
    Index3 high = square.low;
    ++high[square.axis];
    if (boxes.face(square.axis, square.low) == CrackBoxes::Face::inside)
      halve_inner_edges(mesh, square, found[s]);
    for (CrackCap cap : found[s]) {
      cap.fragment = boxes.fragment(boxes.find(square.low));
      caps.push_back(cap);
      cap.fragment = boxes.fragment(boxes.find(high));
      cap.box = high;
      std::swap(cap.corners[0], cap.corners[2]);
      caps.push_back(cap);
    }
  }
  return CapOutcome::done;
}

}  // namespace flexel::mapping
