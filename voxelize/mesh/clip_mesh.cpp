// Face by face of the box; what closes one is cut by the next.
#include "voxelize/mesh/clip_mesh.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace flexel::voxelize {
namespace {

using Ends = std::array<std::uint32_t, 2>;  // the lower vertex first

class Clipper {
 public:
  // Keeps of `mesh` what lies at x[axis] >= value, or with `below` at x[axis] <= value.
  Clipper(PartMesh& mesh, int axis, double value, bool below)
      : mesh_(mesh), axis_(axis), value_(value), below_(below) {}

  void clip() {
    std::vector<Corners> corners;
    std::vector<std::uint32_t> polygon;
    std::swap(corners, mesh_.corners);
    std::swap(polygon, mesh_.polygon);
    for (std::size_t t = 0; t < corners.size(); ++t) add(corners[t], polygon[t]);
    close();
  }

 private:
  // Of a vertex from the plane, positive where it is kept.
  [[nodiscard]] double inside(std::uint32_t v) const {
    const double away = mesh_.vertices[v][axis_] - value_;
    return below_ ? -away : away;
  }

  // Where the plane cuts an edge: one vertex, whatever triangle asks.
  std::uint32_t cut(std::uint32_t a, std::uint32_t b) {
    const Ends ends{std::min(a, b), std::max(a, b)};
    const auto [found, is_new] = cuts_.try_emplace(ends, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (is_new) {
      const double low = inside(ends[0]), high = inside(ends[1]);
      Vec3 at =
          mesh_.vertices[ends[0]] + low / (low - high) * (mesh_.vertices[ends[1]] - mesh_.vertices[ends[0]]);
      at[axis_] = value_;
      mesh_.vertices.push_back(at);
    }
    return found->second;
  }

  void add(const Corners& corners, std::uint32_t polygon) {
    std::vector<std::uint32_t> kept;
    for (int a = 0; a < 3; ++a) {
      const std::uint32_t v = corners[a], next = corners[(a + 1) % 3];
      if (inside(v) >= 0) kept.push_back(v);
      if ((inside(v) >= 0) != (inside(next) >= 0)) kept.push_back(cut(v, next));
    }
    for (std::size_t a = 2; a < kept.size(); ++a) emit({kept[0], kept[a - 1], kept[a]}, polygon);
  }

  void emit(const Corners& corners, std::uint32_t polygon) {
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) return;
    mesh_.corners.push_back(corners);
    mesh_.polygon.push_back(polygon);
  }

  // Edges on the plane that run more often one way get as many triangles of the cone that run the other.
  void close() {
    std::map<Ends, int> balance;
    for (const Corners& c : mesh_.corners)
      for (int a = 0; a < 3; ++a) {
        const std::uint32_t from = c[a], to = c[(a + 1) % 3];
        if (inside(from) == 0 && inside(to) == 0)
          balance[{std::min(from, to), std::max(from, to)}] += from < to ? 1 : -1;
      }
    std::erase_if(balance, [](const auto& each) { return each.second == 0; });
    if (balance.empty()) return;
    // beside the middle, so that no edge of a regular section points at it
    Vec3 apex = Vec3(0.0123, 0.0076, 0.0047);
    for (const auto& each : balance)
      apex += 0.5 * (mesh_.vertices[each.first[0]] + mesh_.vertices[each.first[1]]) /
              static_cast<double>(balance.size());
    apex[axis_] = value_;
    const auto top = static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.push_back(apex);
    for (const auto& [ends, count] : balance)
      for (int n = 0; n < std::abs(count); ++n)
        emit(count > 0 ? Corners{ends[1], ends[0], top} : Corners{ends[0], ends[1], top}, kNoPolygon);
  }

  PartMesh& mesh_;
  int axis_;
  double value_;
  bool below_;
  std::map<Ends, std::uint32_t> cuts_;
};

void drop_unused_vertices(PartMesh& mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnused);
  std::vector<Vec3> used;
  for (Corners& corners : mesh.corners)
    for (std::uint32_t& v : corners) {
      if (number[v] == kUnused) {
        number[v] = static_cast<std::uint32_t>(used.size());
        used.push_back(mesh.vertices[v]);
      }
      v = number[v];
    }
  mesh.vertices = std::move(used);
}

}  // namespace

PartMesh clipped_to_box(const PartMesh& mesh, const Lattice& lattice, const Vec3& lower, const Vec3& upper) {
  PartMesh clipped;
  clipped.vertices = mesh.vertices;
  clipped.corners = mesh.corners;
  clipped.polygon = mesh.polygon;
  for (int axis = 0; axis < 3; ++axis) {
    Clipper(clipped, axis, lower[axis], false).clip();
    Clipper(clipped, axis, upper[axis], true).clip();
  }
  drop_unused_vertices(clipped);
  for (const Vec3& at : clipped.vertices) clipped.world.push_back(lattice.to_world(at));
  number_edges(clipped);
  return clipped;
}

}  // namespace flexel::voxelize
