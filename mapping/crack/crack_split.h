// Cuts the triangles of a part's surface along the planes between boxes, as far as they span two fragments.
// Every new point is named by what it lies on (an edge and a plane, or a triangle and two planes) and its
// position is computed from that alone: triangles that share it find the same, in whatever order they are
// cut.
#pragma once
#include <limits>
#include <optional>
#include <unordered_map>

#include "mapping/crack/crack_boxes.h"

namespace flexel::mapping {

constexpr int kNoPlane = std::numeric_limits<int>::min();

// A point that is no vertex of the surface.
struct CrackNode {
  Vec3 u;                                                  // box coordinates
  Vec3 world;                                              // m
  std::array<int, 3> plane{kNoPlane, kNoPlane, kNoPlane};  // per axis: the plane that it lies on
  std::array<std::uint32_t, 3> from{};                     // vertices that it lies between ...
  Vec3 weight = Vec3::Zero();                              // ... and their shares; 0: inside the part
};

// A convex piece of a triangle that lies in boxes of one fragment.
struct CrackBit {
  std::uint32_t triangle = 0;
  std::uint32_t fragment = 0;
  std::uint32_t begin = 0, end = 0;  // its corners
  bool changed = false;              // it is not the whole triangle, or has more corners
  BoxRange range;                    // boxes that it lies in
};

// The surface of one part while it is cut. Nodes below the number of the surface's vertices are these.
class CrackMesh {
 public:
  // `triangles`: those of the part, corners are vertices of `surface`. `welded`: weld(surface.vertices). `u`:
  // of each vertex. All must outlive this.
  CrackMesh(const Surface& surface, const std::vector<std::uint32_t>& welded, const std::vector<Vec3>& u,
            const Lattice& lattice, double half, const std::vector<std::array<std::uint32_t, 3>>& triangles,
            const CrackBoxes& boxes);

  // Cuts all triangles. False: rounding got in the way; try another shift.
  [[nodiscard]] bool split();
  // Gives the surface a point on every cut along a crack inside a fragment that runs from one side of a
  // square to another, where the cut's sides may be joined: in between they part. Before insert_points().
  void halve_cuts();
  // Puts the points that lie on the edges of bits into their corners, so that neighbours share every edge. To
  // be called when no more points come.
  void insert_points();

  [[nodiscard]] const std::vector<CrackBit>& bits() const { return bits_; }
  [[nodiscard]] std::vector<CrackBit>& bits() { return bits_; }
  [[nodiscard]] std::span<const std::uint32_t> corners(const CrackBit& bit) const {
    return {corners_.data() + bit.begin, bit.end - bit.begin};
  }
  [[nodiscard]] const std::vector<std::array<std::uint32_t, 3>>& triangles() const { return triangles_; }
  [[nodiscard]] const CrackBoxes& boxes() const { return boxes_; }
  [[nodiscard]] bool is_vertex(std::uint32_t node) const { return node < vertex_count_; }
  [[nodiscard]] const Vec3& u(std::uint32_t node) const {
    return is_vertex(node) ? u_[node] : nodes_[node - vertex_count_].u;
  }
  [[nodiscard]] int plane(std::uint32_t node, int axis) const {
    return is_vertex(node) ? kNoPlane : nodes_[node - vertex_count_].plane[axis];
  }
  [[nodiscard]] const std::vector<CrackNode>& nodes() const { return nodes_; }
  // The same for all vertices at one position.
  [[nodiscard]] std::uint32_t welded(std::uint32_t node) const {
    return is_vertex(node) ? welded_[node] : node;
  }

  // Where two of a triangle's edges pass plane `index` of `axis`.
  struct Crossing {
    std::array<Vec3, 2> u;
    std::array<Vec3, 2> weight;  // shares of the triangle's corners
  };
  [[nodiscard]] std::optional<Crossing> crossing(std::uint32_t triangle, int axis, int index) const;
  // The point where a triangle meets two planes (a < b), known to exist.
  [[nodiscard]] std::uint32_t pierce_node(std::uint32_t triangle, int a, int i, int b, int j);
  // A point inside the part, on the planes that `plane` names.
  [[nodiscard]] std::uint32_t add_node(const Vec3& u, const std::array<int, 3>& plane);

 private:
  struct Key {
    std::uint64_t first = 0, second = 0;
    bool operator==(const Key&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Key& key) const {
      return (key.first * 0x9e3779b97f4a7c15ULL ^ key.second) * 0xbf58476d1ce4e5b9ULL >> 7;
    }
  };
  struct Corner {
    std::uint32_t node;
    int edge;  // of the triangle, on which the way to the next corner runs; 3: on a cut
  };
  struct Polygon {
    std::vector<Corner> corners;
    BoxRange range;
  };
  [[nodiscard]] Vec3 world(const Vec3& u) const { return lattice_.to_world(u + Vec3::Constant(half_)); }
  [[nodiscard]] Key edge_key(std::uint32_t triangle, int edge) const;
  [[nodiscard]] static Key cut_key(std::uint32_t triangle, int axis, int index);
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> edge_ends(std::uint32_t triangle, int edge) const;
  [[nodiscard]] std::uint32_t edge_node(std::uint32_t triangle, int edge, int axis, int index);
  [[nodiscard]] std::uint32_t node_between(std::uint32_t triangle, const Corner& from, std::uint32_t to,
                                           int axis, int index);
  void narrow(Polygon& polygon) const;
  [[nodiscard]] bool cut(std::uint32_t triangle, const Polygon& polygon, CrackBoxes::Plane plane,
                         Polygon& below, Polygon& above);
  void finish(std::uint32_t triangle, const Polygon& polygon);
  void points_between(std::uint32_t triangle, const Corner& from, std::uint32_t to,
                      std::vector<std::uint32_t>& result) const;

  const Surface& surface_;
  const std::vector<std::uint32_t>& welded_;
  const std::vector<Vec3>& u_;
  const Lattice& lattice_;
  double half_;
  const std::vector<std::array<std::uint32_t, 3>>& triangles_;
  const CrackBoxes& boxes_;
  std::uint32_t vertex_count_;
  std::vector<CrackNode> nodes_;
  std::unordered_map<Key, std::uint32_t, Hash> number_;             // of points on edges and in triangles
  std::unordered_map<Key, std::vector<std::uint32_t>, Hash> line_;  // points on edges and cuts
  std::vector<CrackBit> bits_;
  std::vector<Corner> cut_corners_;     // (corners) while cutting
  std::vector<std::uint32_t> corners_;  // (corners) once points are inserted
  bool degenerate_ = false;
};

}  // namespace flexel::mapping
