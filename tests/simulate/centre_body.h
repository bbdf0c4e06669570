// Builds the centre-placed body of a box, with its surface, for tests of model `paper`.
#pragma once
#include <algorithm>
#include <functional>

#include "tests/simulate/box_body.h"

namespace flexel::simulate::testing {

struct CentreOptions {
  std::array<int, 3> voxels{2, 2, 2};
  double spacing = 1;
  Vec3 origin = Vec3::Zero();
  Mat3 axes = Mat3::Identity();
  std::string name = "box";
  std::function<bool(int, int, int)> inside = {};  // default: all
};

// An element at the centre of every voxel, connected with every neighbour; the surface is that of box_body().
inline Body centre_body(const CentreOptions& options = {}) {
  BoxOptions box;
  box.cells = options.voxels;
  box.spacing = Vec3::Constant(options.spacing);
  box.origin = options.origin;
  box.axes = options.axes;
  box.name = options.name;
  const Body corners = box_body(box);
  Body body;
  body.surface = corners.surface;
  Part part = corners.parts[0];
  part.placement = Placement::centre;
  const auto inside = [&](int i, int j, int k) {
    const Index3 at{i, j, k};
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (at[axis] < 0 || at[axis] >= options.voxels[axis]) return false;
    return !options.inside || options.inside(i, j, k);
  };
  for (int k = 0; k < options.voxels[2]; ++k)
    for (int j = 0; j < options.voxels[1]; ++j)
      for (int i = 0; i < options.voxels[0]; ++i) {
        if (!inside(i, j, k)) continue;
        body.lattice_index.push_back({i, j, k});
        body.piece.push_back(0);
        body.rest.push_back(part.lattice.to_world(Vec3(i + .5, j + .5, k + .5)));
        std::uint32_t bits = 0;
        for (std::size_t b = 0; b < half_neighbourhood.size(); ++b) {
          const Index3& d = half_neighbourhood[b];
          if (inside(i + d[0], j + d[1], k + d[2])) bits |= 1u << b;
        }
        body.connections.push_back(bits);
      }
  body.position = body.rest;
  part.element_end = static_cast<std::uint32_t>(body.rest.size());
  part.cell_begin = part.cell_end = 0;
  body.parts.push_back(part);
  return body;
}

}  // namespace flexel::simulate::testing
