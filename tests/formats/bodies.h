// Bodies for the tests: blocks of voxels with random holes, with and without a surface.
#pragma once
#include <algorithm>
#include <random>
#include <set>

#include "formats/lattice/body.h"
#include "formats/lattice/cell_moments.h"

namespace flexel::test {

inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline Lattice random_lattice(std::mt19937_64& random) {
  Lattice lattice;
  const Vec3 axis = Vec3(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)).normalized();
  const double angle = uniform(random, 0, 3), c = std::cos(angle), s = std::sin(angle);
  Mat3 cross;
  cross << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  lattice.axes = c * Mat3::Identity() + s * cross + (1 - c) * axis * axis.transpose();  // Rodrigues
  lattice.origin = Vec3(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
  lattice.spacing = Vec3(uniform(random, 0.1, 1), uniform(random, 0.1, 1), uniform(random, 0.1, 1));
  return lattice;
}

using Key = std::array<std::int32_t, 3>;  // k, j, i: the order of elements

inline std::vector<Key> random_voxels(std::mt19937_64& random, int side, double share) {
  std::set<Key> voxels = {{0, 0, 0}};
  for (int n = 0; n < side * side * side; ++n)
    if (uniform(random, 0, 1) < share) voxels.insert({n / side / side - 2, n / side % side - 1, n % side});
  return {voxels.begin(), voxels.end()};
}

inline void add_element(Body& body, const Part& part, const Key& key, double half) {
  const Index3 index = {key[2], key[1], key[0]};
  body.lattice_index.push_back(index);
  body.piece.push_back(0);
  const Vec3 rest = part.lattice.to_world(Vec3(index[0] + half, index[1] + half, index[2] + half));
  body.rest.push_back(rest);
  body.position.push_back(rest);
  body.connections.push_back(0);
}

// A part whose cells are `voxels` (sorted).
inline void add_corner_part(Body& body, Part part, const std::vector<Key>& voxels, std::mt19937_64& random) {
  part.placement = Placement::corner;
  part.element_begin = static_cast<std::uint32_t>(body.element_count());
  part.cell_begin = static_cast<std::uint32_t>(body.cell_count());
  std::set<Key> corners;
  for (const Key& v : voxels)
    for (int a = 0; a < 8; ++a) corners.insert({v[0] + (a >> 2), v[1] + (a >> 1 & 1), v[2] + (a & 1)});
  const std::vector<Key> sorted(corners.begin(), corners.end());
  for (const Key& key : sorted) add_element(body, part, key, 0);
  for (const Key& v : voxels) {
    std::array<std::uint32_t, 8> cell{};
    for (int a = 0; a < 8; ++a) {
      const Key key = {v[0] + (a >> 2), v[1] + (a >> 1 & 1), v[2] + (a & 1)};
      const auto at = std::lower_bound(sorted.begin(), sorted.end(), key) - sorted.begin();
      cell[a] = part.element_begin + static_cast<std::uint32_t>(at);
    }
    body.cell_elements.push_back(cell);
    body.fill.push_back(uniform(random, 0.02, 1));
    body.broken.push_back(uniform(random, 0, 1) < 0.1 ? 1 : 0);
  }
  part.element_end = static_cast<std::uint32_t>(body.element_count());
  part.cell_end = static_cast<std::uint32_t>(body.cell_count());
  body.parts.push_back(part);
}

// A part with an element at the centre of each voxel; each possible connection is there with probability
// `share`.
inline void add_centre_part(Body& body, Part part, const std::vector<Key>& voxels, double share,
                            std::mt19937_64& random) {
  part.placement = Placement::centre;
  part.element_begin = static_cast<std::uint32_t>(body.element_count());
  part.cell_begin = part.cell_end = static_cast<std::uint32_t>(body.cell_count());
  const std::set<Key> present(voxels.begin(), voxels.end());
  for (const Key& v : voxels) {
    add_element(body, part, v, 0.5);
    for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
      const Index3& d = half_neighbourhood[bit];
      if (present.count({v[0] + d[2], v[1] + d[1], v[2] + d[0]}) != 0 && uniform(random, 0, 1) < share)
        body.connections.back() |= 1u << bit;
    }
  }
  part.element_end = static_cast<std::uint32_t>(body.element_count());
  body.parts.push_back(part);
}

// One tetrahedron a part, with a named and a nameless face, and the cells its polygons bound.
inline void add_surface(Body& body, std::mt19937_64& random) {
  Surface& surface = body.surface;
  surface.polygon_offsets = {0};
  body.surface_cell_offsets = {0};
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const auto base = static_cast<std::uint32_t>(surface.vertices.size());
    for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)})
      surface.vertices.push_back(part.lattice.to_world(corner));
    surface.faces.push_back({"", p});
    surface.faces.emplace_back().name = "top </AppendedData> \"\xC3\xA9\" & \n";
    surface.faces.back().part = p;
    for (const std::array<std::uint32_t, 3>& t :
         {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}) {
      for (const std::uint32_t v : t) surface.polygon_vertices.push_back(base + v);
      surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
      surface.polygon_face.push_back(2 * p + (t[0] == 1 ? 1 : 0));
      for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
        if (uniform(random, 0, 1) < 0.5) body.surface_cells.push_back(c);
      body.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body.surface_cells.size()));
    }
    surface.parts.push_back({part.name});
    surface.part_source.push_back(p % 2);
  }
  SurfaceSource obj{"a.obj", "obj", 1e-3, false, 0xfedcba9876543210u, Bytes(700000), {}};
  for (std::byte& byte : obj.bytes) byte = static_cast<std::byte>(random() % 7);
  SurfaceSource stl{"b \xFF.stl", "stl-binary", 0.0254, true, 1, {}, Bytes(80, std::byte{'h'})};
  surface.sources = {obj, stl};
}

// Moments of about half of the cells, of every kind that adds up to the fill.
inline void add_moments(Body& body, std::mt19937_64& random) {
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (uniform(random, 0, 1) < 0.5) continue;
    body.moment_cells.push_back(c);
    double rest = body.fill[c];
    for (std::size_t k = 0; k + 1 < kMoments; ++k) {
      body.moments.push_back(uniform(random, -1, 1));
      rest -= body.moments.back();
    }
    body.moments.push_back(rest);
  }
}

// Two corner-placed parts, one centre-placed, a surface, columns and notes; numbers of every kind.
inline Body random_body(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Body body;
  const std::vector<std::string> names = {"shaft", "lever <2>", "w\xFFrm"},
                                 materials = {"steel", "", "steel"};
  for (std::size_t p = 0; p < names.size(); ++p) {
    Part part;
    part.name = names[p];
    part.material = materials[p];
    part.lattice = random_lattice(random);
    part.surface_volume = uniform(random, 0, 1);
    const std::vector<Key> voxels = random_voxels(random, 4, 0.6);
    if (p == 1)
      add_centre_part(body, part, voxels, 0.7, random);
    else
      add_corner_part(body, part, voxels, random);
  }
  derive_connections(body);
  for (Vec3& position : body.position)
    position += 0.1 * Vec3(uniform(random, -1, 1), uniform(random, -1, 1), 1);
  body.position[0] = Vec3(-0.0, 5e-324, -1.7e308);
  Column velocity{3, {}}, stress{1, {}};
  for (std::size_t i = 0; i < 3 * body.element_count(); ++i)
    velocity.values.push_back(uniform(random, -1, 1));
  for (std::size_t i = 0; i < body.cell_count(); ++i) stress.values.push_back(uniform(random, 0, 1e9));
  body.element_columns["velocity"] = velocity;
  body.cell_columns["von_mises"] = stress;
  body.notes = {{"history", "line 1\nline 2 <b>"}, {"isa", "\xFE"}};
  add_surface(body, random);
  Column color{4, {}}, quality{1, {}};
  for (std::size_t i = 0; i < 4 * body.surface.polygon_count(); ++i)
    color.values.push_back(uniform(random, 0, 1));
  for (std::size_t i = 0; i < body.surface.vertices.size(); ++i)
    quality.values.push_back(uniform(random, -1e300, 1));
  body.surface.polygon_columns[kColorColumn] = color;
  body.surface.vertex_columns = {{"quality", quality}, {"offsets", quality}};
  add_moments(body, random);
  return body;
}

}  // namespace flexel::test
