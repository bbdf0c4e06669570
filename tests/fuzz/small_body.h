// A bar of two cells whose surface is a tetrahedron; every array of the format is there.
#pragma once
#include "formats/lattice/body_file.h"
#include "tests/fuzz/tetrahedron.h"

namespace flexel::fuzz {

inline Body small_body() {
  Body body;
  body.surface = tetrahedron();
  Part part;
  part.name = body.surface.parts.at(0).name;
  part.material = "steel";
  part.lattice.spacing = Vec3(1e-3, 2e-3, 3e-3);
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 3; ++i) {
        body.lattice_index.push_back({i, j, k});
        body.rest.push_back(part.lattice.to_world(Vec3(i, j, k)));
      }
    }
  }
  body.position = body.rest;
  body.piece.assign(body.rest.size(), 0);
  for (std::uint32_t i = 0; i < 2; ++i)
    body.cell_elements.push_back({i, i + 1, i + 3, i + 4, i + 6, i + 7, i + 9, i + 10});
  body.fill = {1.0, 0.5};
  body.broken = {0, 0};
  part.element_end = static_cast<std::uint32_t>(body.rest.size());
  part.cell_end = 2;
  body.parts = {part};
  body.cell_columns["von_mises"] = Column{1, {1e6, 2e6}};
  body.surface_cell_offsets = {0, 1, 2, 3, 5};
  body.surface_cells = {0, 0, 1, 0, 1};
  derive_connections(body);
  return body;
}

inline Bytes file_of(const Body& body, bool compress) {
  const std::string path =
      std::filesystem::temp_directory_path() / ("fuzz-body-" + std::to_string(getpid()) + ".vtu");
  write_body(body, path, {.compress = compress});
  const Bytes bytes = read_all(path);
  std::filesystem::remove(path);
  return bytes;
}

}  // namespace flexel::fuzz
