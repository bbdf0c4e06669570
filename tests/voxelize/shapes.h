// Closed meshes for tests, and what is asked of bodies made of them.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "base/program/progress.h"
#include "formats/lattice/body.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"
#include "voxelize/voxelize.h"

namespace flexel::voxelize::shapes {

struct Mesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

inline Mesh box(const Vec3& low, const Vec3& high) {
  Mesh mesh;
  for (int a = 0; a < 8; ++a)
    mesh.vertices.emplace_back(a & 1 ? high.x() : low.x(), a & 2 ? high.y() : low.y(),
                               a & 4 ? high.z() : low.z());
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

inline Mesh icosphere(int subdivisions, double radius, const Vec3& centre = Vec3::Zero()) {
  const double g = std::numbers::phi;
  Mesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int s = 0; s < subdivisions; ++s) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
      if (fresh) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (Vec3& v : mesh.vertices) v = centre + v.normalized() * radius;
  return mesh;
}

// Around z; `tube` is the small radius.
inline Mesh torus(double radius, double tube, int around, int along) {
  Mesh mesh;
  for (int a = 0; a < around; ++a)
    for (int b = 0; b < along; ++b) {
      const double p = 2 * std::numbers::pi * a / around, q = 2 * std::numbers::pi * b / along;
      mesh.vertices.emplace_back((radius + tube * std::cos(q)) * std::cos(p),
                                 (radius + tube * std::cos(q)) * std::sin(p), tube * std::sin(q));
    }
  const auto at = [&](int a, int b) { return static_cast<std::uint32_t>(a % around * along + b % along); };
  for (int a = 0; a < around; ++a)
    for (int b = 0; b < along; ++b) {
      mesh.triangles.push_back({at(a, b), at(a + 1, b), at(a + 1, b + 1)});
      mesh.triangles.push_back({at(a, b), at(a + 1, b + 1), at(a, b + 1)});
    }
  return mesh;
}

// The polygon (counter-clockwise in x, y) extruded from z = low to high; must be star-shaped about vertex 0
// or convex-fan-able through `caps`, its triangulation.
inline Mesh prism(const std::vector<std::array<double, 2>>& outline,
                  const std::vector<std::array<std::uint32_t, 3>>& caps, double low, double high) {
  Mesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double z : {low, high})
    for (const auto& [x, y] : outline) mesh.vertices.emplace_back(x, y, z);
  for (const auto& [a, b, c] : caps) {
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({a + n, b + n, c + n});
  }
  for (std::uint32_t v = 0; v < n; ++v) {
    const std::uint32_t w = (v + 1) % n;
    mesh.triangles.push_back({v, w, w + n});
    mesh.triangles.push_back({v, w + n, v + n});
  }
  return mesh;
}

// Two leaves of thickness `leaf` and length 1 with a gap between them, along x, joined at x = 0 by a base
// `joint` long (0: apart).
inline Mesh fork(double leaf, double gap, double joint, double width) {
  const double top = 2 * leaf + gap;
  return prism(
      {{0, 0}, {1, 0}, {1, leaf}, {joint, leaf}, {joint, leaf + gap}, {1, leaf + gap}, {1, top}, {0, top}},
      {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 7}, {4, 5, 6}, {4, 6, 7}}, 0, width);
}

inline Mesh merged(const Mesh& a, const Mesh& b) {
  Mesh mesh = a;
  const auto first = static_cast<std::uint32_t>(a.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& [p, q, r] : b.triangles) mesh.triangles.push_back({p + first, q + first, r + first});
  return mesh;
}

inline Mesh inverted(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

inline Mesh transformed(Mesh mesh, const Mat3& rotation, const Vec3& shift = Vec3::Zero()) {
  for (Vec3& v : mesh.vertices) v = rotation * v + shift;
  return mesh;
}

inline Mat3 random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
  return q.normalized().toRotationMatrix();
}

inline Mat3 turned(double x, double y, double z) {
  return (Eigen::AngleAxisd(z, Vec3::UnitZ()) * Eigen::AngleAxisd(y, Vec3::UnitY()) *
          Eigen::AngleAxisd(x, Vec3::UnitX()))
      .toRotationMatrix();
}

// One part.
inline Surface surface(const Mesh& mesh) {
  Surface s;
  s.vertices = mesh.vertices;
  s.polygon_offsets.push_back(0);
  for (const auto& t : mesh.triangles) {
    s.polygon_vertices.insert(s.polygon_vertices.end(), t.begin(), t.end());
    s.polygon_offsets.push_back(static_cast<std::uint32_t>(s.polygon_vertices.size()));
    s.polygon_face.push_back(0);
  }
  s.faces.push_back({"", 0});
  s.parts.push_back({"part"});
  s.sources.emplace_back();
  s.part_source.push_back(0);
  return s;
}

inline double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    sum += (mesh.vertices[a] - mesh.vertices[0])
               .dot((mesh.vertices[b] - mesh.vertices[0]).cross(mesh.vertices[c] - mesh.vertices[0])) /
           6;
  return sum;
}

inline VoxelizeResult run(const Mesh& mesh, double size, Align align = Align::none,
                          Placement placement = Placement::corner) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = size;
  options.align = align;
  options.placement = placement;
  options.max_memory = 1e12;
  VoxelizeResult result = voxelize(surface(mesh), options, progress);
  check(result.body, "test");
  return result;
}

inline double total_volume(const VoxelizedPart& part) {
  return part.lattice_volume + part.dropped_volume;
}

// Of the first part.
inline double total_volume(const VoxelizeResult& result) {
  return total_volume(result.parts[0]);
}

// Connected components of elements (through cells, or bits for centre placement), number of each element.
inline std::vector<std::uint32_t> components(const Body& body, std::uint32_t& count) {
  const Adjacency graph = element_adjacency(body);
  std::vector<std::uint32_t> number(body.element_count(), 0xffffffffu), queue;
  count = 0;
  for (std::uint32_t seed = 0; seed < number.size(); ++seed) {
    if (number[seed] != 0xffffffffu) continue;
    number[seed] = count;
    queue.assign(1, seed);
    while (!queue.empty()) {
      const std::uint32_t e = queue.back();
      queue.pop_back();
      for (const std::uint32_t other : graph.of(e))
        if (number[other] == 0xffffffffu) {
          number[other] = count;
          queue.push_back(other);
        }
    }
    ++count;
  }
  return number;
}

inline std::uint32_t component_count(const Body& body) {
  std::uint32_t count = 0;
  components(body, count);
  return count;
}

}  // namespace flexel::voxelize::shapes
