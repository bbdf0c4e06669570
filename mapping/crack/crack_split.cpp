// Each triangle is split recursively at the planes that have a square of the crack within its extent;
// triangles away from the crack stay. A split may put points on an edge whose other triangle is not cut:
// insert_points() adds them there too.
#include "mapping/crack/crack_split.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace flexel::mapping {

CrackMesh::CrackMesh(const Surface& surface, const std::vector<std::uint32_t>& welded,
                     const std::vector<Vec3>& u, const Lattice& lattice, double half,
                     const std::vector<std::array<std::uint32_t, 3>>& triangles, const CrackBoxes& boxes)
    : surface_(surface),
      welded_(welded),
      u_(u),
      lattice_(lattice),
      half_(half),
      triangles_(triangles),
      boxes_(boxes),
      vertex_count_(static_cast<std::uint32_t>(surface.vertices.size())) {}

// The ends of an edge in an order that both its triangles find.
std::pair<std::uint32_t, std::uint32_t> CrackMesh::edge_ends(std::uint32_t triangle, int edge) const {
  const std::uint32_t a = triangles_[triangle][edge], b = triangles_[triangle][(edge + 1) % 3];
  return welded_[a] < welded_[b] ? std::pair{a, b} : std::pair{b, a};
}

CrackMesh::Key CrackMesh::edge_key(std::uint32_t triangle, int edge) const {
  const auto [a, b] = edge_ends(triangle, edge);
  return {std::uint64_t{welded_[a]} << 32 | welded_[b], 0};
}

CrackMesh::Key CrackMesh::cut_key(std::uint32_t triangle, int axis, int index) {
  return {triangle, std::uint64_t{static_cast<std::uint32_t>(index)} << 2 | static_cast<unsigned>(axis + 1)};
}

std::optional<CrackMesh::Crossing> CrackMesh::crossing(std::uint32_t triangle, int axis, int index) const {
  const double at = boxes_.plane(axis, index);
  Crossing found;
  int count = 0;
  for (int edge = 0; edge < 3; ++edge) {
    const auto [a, b] = edge_ends(triangle, edge);
    if ((u_[a][axis] >= at) == (u_[b][axis] >= at)) continue;
    if (count == 2) return std::nullopt;
    const double t = (at - u_[a][axis]) / (u_[b][axis] - u_[a][axis]);
    found.u[count] = u_[a] + t * (u_[b] - u_[a]);
    found.u[count][axis] = at;
    Vec3 weight = Vec3::Zero();
    for (int c = 0; c < 3; ++c) {
      if (triangles_[triangle][c] == a) weight[c] = 1 - t;
      if (triangles_[triangle][c] == b) weight[c] = t;
    }
    found.weight[count++] = weight;
  }
  if (count != 2) return std::nullopt;
  return found;
}

std::uint32_t CrackMesh::edge_node(std::uint32_t triangle, int edge, int axis, int index) {
  Key key = edge_key(triangle, edge);
  std::vector<std::uint32_t>& line = line_[key];
  key.second = cut_key(0, axis, index).second;
  const auto [it, fresh] =
      number_.try_emplace(key, vertex_count_ + static_cast<std::uint32_t>(nodes_.size()));
  if (!fresh) return it->second;
  const auto [a, b] = edge_ends(triangle, edge);
  const double at = boxes_.plane(axis, index), t = (at - u_[a][axis]) / (u_[b][axis] - u_[a][axis]);
  CrackNode node;
  node.u = u_[a] + t * (u_[b] - u_[a]);
  node.u[axis] = at;
  node.world = surface_.vertices[a] + t * (surface_.vertices[b] - surface_.vertices[a]);
  node.plane[axis] = index;
  node.from = {a, b, a};
  node.weight = {1 - t, t, 0};
  nodes_.push_back(node);
  line.push_back(it->second);
  return it->second;
}

std::uint32_t CrackMesh::pierce_node(std::uint32_t triangle, int a, int i, int b, int j) {
  const Key key{std::uint64_t{triangle} << 2 | static_cast<unsigned>(3 - a - b) | std::uint64_t{1} << 63,
                std::uint64_t{static_cast<std::uint32_t>(i)} << 32 | static_cast<std::uint32_t>(j)};
  const auto [it, fresh] =
      number_.try_emplace(key, vertex_count_ + static_cast<std::uint32_t>(nodes_.size()));
  if (!fresh) return it->second;
  CrackNode node;
  const std::optional<Crossing> ends = crossing(triangle, a, i);
  if (ends) {
    const double at = boxes_.plane(b, j), width = ends->u[1][b] - ends->u[0][b];
    const double s = width != 0 ? (at - ends->u[0][b]) / width : 0.5;
    if (!(s >= 0 && s <= 1)) degenerate_ = true;
    node.u = ends->u[0] + s * (ends->u[1] - ends->u[0]);
    node.u[a] = boxes_.plane(a, i);
    node.u[b] = at;
    node.weight = ends->weight[0] + s * (ends->weight[1] - ends->weight[0]);
  } else {
    degenerate_ = true;
    node.u = u_[triangles_[triangle][0]];
  }
  node.world = world(node.u);
  node.plane[a] = i;
  node.plane[b] = j;
  node.from = triangles_[triangle];
  nodes_.push_back(node);
  line_[cut_key(triangle, a, i)].push_back(it->second);
  line_[cut_key(triangle, b, j)].push_back(it->second);
  return it->second;
}

std::uint32_t CrackMesh::add_node(const Vec3& u, const std::array<int, 3>& plane) {
  CrackNode node;
  node.u = u;
  node.world = world(u);
  node.plane = plane;
  nodes_.push_back(node);
  return vertex_count_ + static_cast<std::uint32_t>(nodes_.size()) - 1;
}

std::uint32_t CrackMesh::node_between(std::uint32_t triangle, const Corner& from, std::uint32_t to, int axis,
                                      int index) {
  if (from.edge < 3) return edge_node(triangle, from.edge, axis, index);
  for (int other = 0; other < 3; ++other) {
    const int on = plane(from.node, other);
    if (on == kNoPlane || on != plane(to, other) || other == axis) continue;
    return other < axis ? pierce_node(triangle, other, on, axis, index)
                        : pierce_node(triangle, axis, index, other, on);
  }
  degenerate_ = true;
  return from.node;
}

// Fits the range to the corners. A corner on a plane lies in the boxes on both its sides.
void CrackMesh::narrow(Polygon& polygon) const {
  for (int axis = 0; axis < 3; ++axis) {
    int low = std::numeric_limits<int>::max(), high = std::numeric_limits<int>::min();
    for (const Corner& corner : polygon.corners) {
      const int on = plane(corner.node, axis);
      const int box = on == kNoPlane ? boxes_.box_of(axis, u(corner.node)[axis]) : on;
      low = std::min(low, on == kNoPlane ? box : on + 1);
      high = std::max(high, box);
    }
    if (low > high) continue;
    polygon.range.low[axis] = std::max(polygon.range.low[axis], std::min(low, polygon.range.high[axis]));
    polygon.range.high[axis] = std::min(polygon.range.high[axis], std::max(high, polygon.range.low[axis]));
  }
}

bool CrackMesh::cut(std::uint32_t triangle, const Polygon& polygon, CrackBoxes::Plane plane, Polygon& below,
                    Polygon& above) {
  const double at = boxes_.plane(plane.axis, plane.index);
  below.range = above.range = polygon.range;
  below.range.high[plane.axis] = plane.index;
  above.range.low[plane.axis] = plane.index + 1;
  const std::size_t n = polygon.corners.size();
  int crossings = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const Corner& corner = polygon.corners[k];
    const std::uint32_t next = polygon.corners[(k + 1) % n].node;
    const bool up = u(corner.node)[plane.axis] >= at, next_up = u(next)[plane.axis] >= at;
    (up ? above : below).corners.push_back(corner);
    if (up == next_up) continue;
    ++crossings;
    const std::uint32_t node = node_between(triangle, corner, next, plane.axis, plane.index);
    // The side that is left goes on along the cut, the other along the edge.
    (up ? above : below).corners.push_back({node, 3});
    (up ? below : above).corners.push_back({node, corner.edge});
  }
  if (crossings != 0 && crossings != 2) return false;
  narrow(below);
  narrow(above);
  return true;
}

void CrackMesh::finish(std::uint32_t triangle, const Polygon& polygon) {
  Vec3 middle = Vec3::Zero();
  for (const Corner& corner : polygon.corners)
    middle += u(corner.node) / static_cast<double>(polygon.corners.size());
  Index3 index = boxes_.box_of(middle);
  for (int axis = 0; axis < 3; ++axis)
    index[axis] = std::clamp(index[axis], polygon.range.low[axis], polygon.range.high[axis]);
  const std::uint32_t box = boxes_.find(index);
  if (box == kNoBox) {
    degenerate_ = true;
    return;
  }
  CrackBit bit;
  bit.triangle = triangle;
  bit.fragment = boxes_.fragment(box);
  bit.begin = static_cast<std::uint32_t>(cut_corners_.size());
  bit.end = bit.begin + static_cast<std::uint32_t>(polygon.corners.size());
  bit.changed = !(polygon.corners.size() == 3 && polygon.corners[0].node == triangles_[triangle][0] &&
                  polygon.corners[1].node == triangles_[triangle][1] &&
                  polygon.corners[2].node == triangles_[triangle][2]);
  bit.range = polygon.range;
  cut_corners_.insert(cut_corners_.end(), polygon.corners.begin(), polygon.corners.end());
  bits_.push_back(bit);
}

bool CrackMesh::split() {
  std::vector<Polygon> left;
  for (std::uint32_t t = 0; t < triangles_.size() && !degenerate_; ++t) {
    const auto& corner = triangles_[t];
    if (welded_[corner[0]] == welded_[corner[1]] || welded_[corner[1]] == welded_[corner[2]] ||
        welded_[corner[2]] == welded_[corner[0]])
      continue;  // a triangle without area bounds nothing
    Polygon whole;
    whole.corners = {{corner[0], 0}, {corner[1], 1}, {corner[2], 2}};
    for (int axis = 0; axis < 3; ++axis) {
      whole.range.low[axis] = std::numeric_limits<int>::min();
      whole.range.high[axis] = std::numeric_limits<int>::max();
    }
    narrow(whole);
    left.push_back(std::move(whole));
    while (!left.empty() && !degenerate_) {
      const Polygon polygon = std::move(left.back());
      left.pop_back();
      const CrackBoxes::Plane plane = boxes_.find_cut(polygon.range);
      if (plane.axis < 0) {
        finish(t, polygon);
        continue;
      }
      Polygon below, above;
      if (!cut(t, polygon, plane, below, above)) return false;
      if (!below.corners.empty()) left.push_back(std::move(below));
      if (!above.corners.empty()) left.push_back(std::move(above));
    }
  }
  return !degenerate_;
}

// Points strictly between two corners, in order. All points of a line are sorted along one of its axes, so
// that both sides find the same order.
void CrackMesh::points_between(std::uint32_t triangle, const Corner& from, std::uint32_t to,
                               std::vector<std::uint32_t>& result) const {
  result.clear();
  Key key;
  if (from.edge < 3) {
    key = edge_key(triangle, from.edge);
  } else {
    for (int axis = 0; axis < 3; ++axis)
      if (const int on = plane(from.node, axis); on != kNoPlane && on == plane(to, axis))
        key = cut_key(triangle, axis, on);
  }
  const auto found = line_.find(key);
  if (found == line_.end()) return;
  // The longest axis of the whole line, not of this stretch of it.
  Vec3 extent = Vec3::Zero();
  if (from.edge < 3) {
    const auto [a, b] = edge_ends(triangle, from.edge);
    extent = (u_[b] - u_[a]).cwiseAbs();
  } else {
    const auto& c = triangles_[triangle];
    Vec3 normal = (u_[c[1]] - u_[c[0]]).cross(u_[c[2]] - u_[c[0]]);
    for (int axis = 0; axis < 3; ++axis)
      if (plane(from.node, axis) != kNoPlane && plane(from.node, axis) == plane(to, axis))
        extent = normal.cross(Vec3::Unit(axis)).cwiseAbs();
  }
  int along = 0;
  extent.maxCoeff(&along);
  const auto less = [&](std::uint32_t a, std::uint32_t b) {
    const double p = u(a)[along], q = u(b)[along];
    return p != q ? p < q : a < b;
  };
  const bool forward = less(from.node, to);
  const std::uint32_t low = forward ? from.node : to, high = forward ? to : from.node;
  for (const std::uint32_t node : found->second)
    if (node != low && node != high && less(low, node) && less(node, high)) result.push_back(node);
  std::sort(result.begin(), result.end(), less);
  if (!forward) std::reverse(result.begin(), result.end());
}

void CrackMesh::halve_cuts() {
  struct Stretch {
    std::uint32_t triangle, from, to;
    int axis, on;
  };
  std::vector<Stretch> stretches;
  std::vector<std::uint32_t> between;
  const auto planes = [&](std::uint32_t node) {
    return (plane(node, 0) != kNoPlane) + (plane(node, 1) != kNoPlane) + (plane(node, 2) != kNoPlane);
  };
  for (const CrackBit& bit : bits_)
    for (std::uint32_t k = bit.begin; k < bit.end; ++k) {
      const Corner& corner = cut_corners_[k];
      const std::uint32_t last = cut_corners_[k + 1 < bit.end ? k + 1 : bit.begin].node;
      if (corner.edge < 3) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const int on = plane(corner.node, axis);
        if (on == kNoPlane || on != plane(last, axis) || bit.range.high[axis] != on) continue;
        points_between(bit.triangle, corner, last, between);
        between.insert(between.begin(), corner.node);
        between.push_back(last);
        for (std::size_t i = 0; i + 1 < between.size(); ++i) {
          if (planes(between[i]) < 2 || planes(between[i + 1]) < 2) continue;
          Index3 low = boxes_.box_of(Vec3(0.5 * (u(between[i]) + u(between[i + 1]))));
          low[axis] = on;
          if (boxes_.face(axis, low) == CrackBoxes::Face::inside)
            stretches.push_back({bit.triangle, between[i], between[i + 1], axis, on});
        }
      }
    }
  for (const Stretch& stretch : stretches) {
    const CrackNode from = nodes_[stretch.from - vertex_count_], to = nodes_[stretch.to - vertex_count_];
    std::array<int, 3> plane{kNoPlane, kNoPlane, kNoPlane};
    plane[stretch.axis] = stretch.on;
    const std::uint32_t node = add_node(0.5 * (from.u + to.u), plane);
    CrackNode& middle = nodes_[node - vertex_count_];
    middle.from = triangles_[stretch.triangle];
    middle.weight = 0.5 * (from.weight + to.weight);
    line_[cut_key(stretch.triangle, stretch.axis, stretch.on)].push_back(node);
  }
}

void CrackMesh::insert_points() {
  std::vector<std::uint32_t> between;
  for (CrackBit& bit : bits_) {
    const std::uint32_t begin = static_cast<std::uint32_t>(corners_.size());
    for (std::uint32_t k = bit.begin; k < bit.end; ++k) {
      const std::uint32_t next = cut_corners_[k + 1 < bit.end ? k + 1 : bit.begin].node;
      corners_.push_back(cut_corners_[k].node);
      points_between(bit.triangle, cut_corners_[k], next, between);
      bit.changed = bit.changed || !between.empty();
      corners_.insert(corners_.end(), between.begin(), between.end());
    }
    bit.begin = begin;
    bit.end = static_cast<std::uint32_t>(corners_.size());
  }
  cut_corners_ = {};
}

}  // namespace flexel::mapping
