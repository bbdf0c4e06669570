#include "bodies.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>

namespace flexel::mapping::test {
namespace {

using Key = std::array<std::int32_t, 3>;  // (k, j, i)

struct Numbering {
  std::map<Key, std::uint32_t> number;  // sorted, as Body wants
};

void add_elements(Body& body, const Numbering& elements) {
  const Lattice& lattice = body.parts.back().lattice;
  const double shift = body.parts.back().placement == Placement::centre ? 0.5 : 0;
  for (const auto& [key, number] : elements.number) {
    body.lattice_index.push_back({key[2], key[1], key[0]});
    body.rest.push_back(lattice.to_world(Vec3(key[2] + shift, key[1] + shift, key[0] + shift)));
  }
  body.piece.assign(body.rest.size(), 0);
  body.position = body.rest;
  body.connections.assign(body.rest.size(), 0);
  body.parts.back().element_end = static_cast<std::uint32_t>(body.rest.size());
}

void number(Numbering& elements) {
  std::uint32_t next = 0;
  for (auto& [key, value] : elements.number) value = next++;
}

void connect_centres(Body& body, const Numbering& elements) {
  for (const auto& [key, value] : elements.number)
    for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
      const Index3& step = half_neighbourhood[bit];
      if (elements.number.count({key[0] + step[2], key[1] + step[1], key[2] + step[0]}))
        body.connections[value] |= 1u << bit;
    }
}

double squared_distance_to_cell(const Body& body, std::uint32_t cell, const Vec3& point) {
  const Part* part = nullptr;
  for (const Part& p : body.parts)
    if (cell >= p.cell_begin && cell < p.cell_end) part = &p;
  const Index3& index = body.lattice_index[body.cell_elements[cell][0]];
  const Vec3 within = part->lattice.to_lattice(point) - Vec3(index[0], index[1], index[2]);
  const Vec3 outside = within - within.cwiseMax(0.0).cwiseMin(1.0);
  return outside.cwiseProduct(part->lattice.spacing).squaredNorm();
}

}  // namespace

Body make_body(const Lattice& lattice, const Index3& low, const Index3& high, const Solid& solid,
               Placement placement) {
  Body body;
  Part part;
  part.name = "part";
  part.placement = placement;
  part.lattice = lattice;
  body.parts.push_back(part);
  std::vector<Key> voxels;
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i)
        if (solid(lattice.to_world(Vec3(i + 0.5, j + 0.5, k + 0.5)))) voxels.push_back({k, j, i});
  Numbering elements;
  const int reach = placement == Placement::corner ? 8 : 1;
  for (const Key& v : voxels)
    for (int a = 0; a < reach; ++a)
      elements.number[{v[0] + (a >> 2), v[1] + (a >> 1 & 1), v[2] + (a & 1)}] = 0;
  number(elements);
  add_elements(body, elements);
  if (placement == Placement::centre) {
    connect_centres(body, elements);
    return body;
  }
  for (const Key& v : voxels) {
    std::array<std::uint32_t, 8> cell{};
    for (int a = 0; a < 8; ++a)
      cell[a] = elements.number[{v[0] + (a >> 2), v[1] + (a >> 1 & 1), v[2] + (a & 1)}];
    body.cell_elements.push_back(cell);
  }
  body.fill.assign(body.cell_count(), 1);
  body.broken.assign(body.cell_count(), 0);
  body.parts.back().cell_end = static_cast<std::uint32_t>(body.cell_count());
  derive_connections(body);
  return body;
}

void append_body(Body& body, const Body& other) {
  const auto elements = static_cast<std::uint32_t>(body.element_count());
  const auto cells = static_cast<std::uint32_t>(body.cell_count());
  for (Part part : other.parts) {
    part.name = fmt::format("{}-{}", part.name, body.parts.size() + 1);
    part.element_begin += elements;
    part.element_end += elements;
    part.cell_begin += cells;
    part.cell_end += cells;
    body.parts.push_back(part);
  }
  const auto join = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  join(body.lattice_index, other.lattice_index);
  join(body.piece, other.piece);
  join(body.rest, other.rest);
  join(body.position, other.position);
  join(body.connections, other.connections);
  join(body.fill, other.fill);
  join(body.broken, other.broken);
  for (std::array<std::uint32_t, 8> cell : other.cell_elements) {
    for (std::uint32_t& element : cell) element += elements;
    body.cell_elements.push_back(cell);
  }
  for (std::size_t p = 0; p < body.surface.parts.size() || p < body.parts.size(); ++p)
    body.surface.parts.resize(body.parts.size()), body.surface.parts[p].name = body.parts[p].name;
  if (other.surface.polygon_count() == 0) return;
  std::vector<std::vector<std::uint32_t>> polygons;
  for (std::size_t p = 0; p < other.surface.polygon_count(); ++p)
    polygons.emplace_back(other.surface.polygon(p).begin(), other.surface.polygon(p).end());
  add_surface(body, other.surface.vertices, polygons);
}

void add_surface(Body& body, const std::vector<Vec3>& vertices,
                 const std::vector<std::vector<std::uint32_t>>& polygons) {
  Surface& surface = body.surface;
  const auto part = static_cast<std::uint32_t>(body.parts.size() - 1);
  const auto first = static_cast<std::uint32_t>(surface.vertices.size());
  surface.parts.resize(body.parts.size());
  for (std::size_t p = 0; p <= part; ++p) surface.parts[p].name = body.parts[p].name;
  surface.part_source.assign(body.parts.size(), 0);
  surface.sources.resize(1);
  surface.faces.push_back({"face", part});
  surface.vertices.insert(surface.vertices.end(), vertices.begin(), vertices.end());
  if (surface.polygon_offsets.empty()) surface.polygon_offsets.push_back(0);
  for (const auto& polygon : polygons) {
    for (const std::uint32_t v : polygon) surface.polygon_vertices.push_back(first + v);
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(static_cast<std::uint32_t>(surface.faces.size() - 1));
  }
  derive_surface_cells(body);
}

void derive_surface_cells(Body& body) {
  body.surface_cell_offsets.clear();
  body.surface_cells.clear();
  if (body.cell_count() == 0) return;
  // Cells by voxel, a part at a time, so that a point looks at the voxels around it only.
  std::vector<std::map<Key, std::uint32_t>> at(body.parts.size());
  for (std::size_t p = 0; p < body.parts.size(); ++p)
    for (std::uint32_t c = body.parts[p].cell_begin; c < body.parts[p].cell_end; ++c) {
      const Index3& index = body.lattice_index[body.cell_elements[c][0]];
      at[p][{index[2], index[1], index[0]}] = c;
    }
  const auto nearest = [&](std::uint32_t part, const Vec3& point) {
    const Vec3 u = body.parts[part].lattice.to_lattice(point);
    double best = std::numeric_limits<double>::infinity();
    std::uint32_t cell = 0;
    for (int reach = 2; best > 1e299; reach *= 2)
      for (int n = 0; n < (2 * reach + 1) * (2 * reach + 1) * (2 * reach + 1); ++n) {
        const int w = 2 * reach + 1, i = n % w - reach, j = n / w % w - reach, k = n / w / w - reach;
        const auto found =
            at[part].find({static_cast<int>(std::floor(u.z())) + k, static_cast<int>(std::floor(u.y())) + j,
                           static_cast<int>(std::floor(u.x())) + i});
        if (found == at[part].end()) continue;
        const double distance = squared_distance_to_cell(body, found->second, point);
        if (distance < best) best = distance, cell = found->second;
      }
    return cell;
  };
  body.surface_cell_offsets.push_back(0);
  for (std::size_t p = 0; p < body.surface.polygon_count(); ++p) {
    const std::uint32_t part = body.surface.polygon_part(p);
    std::vector<std::uint32_t> cells;
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t v : body.surface.polygon(p)) {
      middle += body.surface.vertices[v] / static_cast<double>(body.surface.polygon(p).size());
      if (!at[part].empty()) cells.push_back(nearest(part, body.surface.vertices[v]));
    }
    if (!at[part].empty()) cells.push_back(nearest(part, middle));
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    body.surface_cells.insert(body.surface_cells.end(), cells.begin(), cells.end());
    body.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body.surface_cells.size()));
  }
}

void add_box_surface(Body& body, const Vec3& low, const Vec3& high, int n) {
  std::vector<Vec3> vertices;
  std::map<Key, std::uint32_t> number;
  std::vector<std::vector<std::uint32_t>> quads;
  const auto vertex = [&](const Key& key) {
    const auto [it, fresh] = number.try_emplace(key, static_cast<std::uint32_t>(vertices.size()));
    if (fresh) vertices.push_back(low + Vec3(key[0], key[1], key[2]).cwiseProduct(high - low) / n);
    return it->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int a = 0; a < n; ++a)
        for (int b = 0; b < n; ++b) {
          std::vector<std::uint32_t> quad;
          for (const auto& [s, t] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
            Key key{};
            key[axis] = side * n;
            key[(axis + 1) % 3] = a + s;
            key[(axis + 2) % 3] = b + t;
            quad.push_back(vertex(key));
          }
          if (side == 0) std::reverse(quad.begin(), quad.end());
          quads.push_back(quad);
        }
  add_surface(body, vertices, quads);
}

void add_tube_surface(Body& body, double length, double radius, int along, int around) {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> quads;
  for (int i = 0; i <= along; ++i)
    for (int j = 0; j < around; ++j) {
      const double angle = 2 * M_PI * (j + 0.31) / around;
      vertices.emplace_back(length * i / along, radius * std::cos(angle), radius * std::sin(angle));
    }
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < around; ++j) {
      const auto at = [&](int a, int b) { return static_cast<std::uint32_t>(a * around + b % around); };
      quads.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
    }
  add_surface(body, vertices, quads);
}

Body block(int nx, int ny, int nz, double h, Placement placement, int n) {
  Lattice lattice;
  lattice.spacing = Vec3::Constant(h);
  Body body = make_body(
      lattice, {0, 0, 0}, {nx, ny, nz}, [](const Vec3&) { return true; }, placement);
  const Vec3 size = h * Vec3(nx, ny, nz);
  add_box_surface(body, 0.013 * h * Vec3::Ones(), size - 0.017 * h * Vec3::Ones(), n);
  return body;
}

void deform(Body& body, const Field& field) {
  for (std::size_t e = 0; e < body.element_count(); ++e) body.position[e] = field(body.rest[e]);
}

Mat3 rotation(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

}  // namespace flexel::mapping::test
