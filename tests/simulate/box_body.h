// Builds the body of a box, with its surface, for tests of the simulation.
#pragma once
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate::testing {

struct BoxOptions {
  std::array<int, 3> cells{2, 2, 2};
  Vec3 spacing = Vec3::Ones();
  Vec3 origin = Vec3::Zero();
  Mat3 axes = Mat3::Identity();
  std::string name = "box";
  std::function<double(int, int, int)> fill = {};  // 0: no cell; default 1
};

// Box of cells with eight-cornered surface: six quads, the faces "x0", "x1", "y0", "y1", "z0", "z1", outward.
// Surface cells are the cells of each side. With a `fill`, the surface stays that of the whole box.
inline Body box_body(const BoxOptions& options = {}) {
  Body body;
  Part part;
  part.name = options.name;
  part.lattice = {options.origin, options.axes, options.spacing};
  const int nx = options.cells[0], ny = options.cells[1], nz = options.cells[2];
  const auto fill_at = [&](int i, int j, int k) {
    if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) return 0.0;
    return options.fill ? options.fill(i, j, k) : 1.0;
  };
  std::vector<std::int64_t> id(static_cast<std::size_t>((nx + 1) * (ny + 1) * (nz + 1)), -1);
  const auto at = [&](int i, int j, int k) -> std::int64_t& {
    return id[static_cast<std::size_t>(i + (nx + 1) * (j + (ny + 1) * k))];
  };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) {
        bool used = false;
        for (int n = 0; n < 8; ++n) used = used || fill_at(i - (n & 1), j - (n >> 1 & 1), k - (n >> 2)) > 0;
        if (!used) continue;
        at(i, j, k) = static_cast<std::int64_t>(body.rest.size());
        body.lattice_index.push_back({i, j, k});
        body.piece.push_back(0);
        body.rest.push_back(part.lattice.to_world(Vec3(i, j, k)));
      }
  body.position = body.rest;
  std::vector<std::int64_t> cell_id(static_cast<std::size_t>(nx * ny * nz), -1);
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        if (!(fill_at(i, j, k) > 0)) continue;
        cell_id[static_cast<std::size_t>(i + nx * (j + ny * k))] =
            static_cast<std::int64_t>(body.fill.size());
        std::array<std::uint32_t, 8> corners;
        for (int a = 0; a < 8; ++a)
          corners[static_cast<std::size_t>(a)] =
              static_cast<std::uint32_t>(at(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2)));
        body.cell_elements.push_back(corners);
        body.fill.push_back(fill_at(i, j, k));
        body.broken.push_back(0);
      }
  part.element_end = static_cast<std::uint32_t>(body.rest.size());
  part.cell_end = static_cast<std::uint32_t>(body.fill.size());

  Surface& surface = body.surface;
  for (int c = 0; c < 8; ++c)
    surface.vertices.push_back(part.lattice.to_world(Vec3((c & 1) * nx, (c >> 1 & 1) * ny, (c >> 2) * nz)));
  const std::array<std::array<std::uint32_t, 4>, 6> quads = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  const std::array<const char*, 6> names = {"x0", "x1", "y0", "y1", "z0", "z1"};
  surface.polygon_offsets = {0};
  body.surface_cell_offsets = {0};
  for (std::uint32_t f = 0; f < 6; ++f) {
    surface.polygon_vertices.insert(surface.polygon_vertices.end(), quads[f].begin(), quads[f].end());
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(f);
    surface.faces.push_back({names[f], 0});
    for (int k = 0; k < nz; ++k)
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
          const std::array<int, 3> index{i, j, k};
          const auto axis = static_cast<std::size_t>(f / 2);
          const std::int64_t cell = cell_id[static_cast<std::size_t>(i + nx * (j + ny * k))];
          if (cell >= 0 && index[axis] == (f % 2 ? options.cells[axis] - 1 : 0))
            body.surface_cells.push_back(static_cast<std::uint32_t>(cell));
        }
    body.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body.surface_cells.size()));
  }
  surface.parts.push_back({options.name});
  SurfaceSource source;
  source.file = options.name;
  source.format = "stl-binary";
  surface.sources.push_back(source);
  surface.part_source.push_back(0);
  part.surface_volume = options.spacing.prod() * nx * ny * nz;
  body.parts.push_back(part);
  derive_connections(body);
  return body;
}

// 3 x 2 x 2 cells of 10 mm.
inline Body small_box() {
  return box_body({.cells = {3, 2, 2}, .spacing = Vec3::Constant(0.01)});
}

// What a run starts with, in the body's columns [m/s].
inline void set_velocity(Body& body, const std::vector<Vec3>& velocity) {
  Column column;
  column.components = 3;
  for (const Vec3& v : velocity) column.values.insert(column.values.end(), v.begin(), v.end());
  body.element_columns["velocity"] = column;
}

}  // namespace flexel::simulate::testing
