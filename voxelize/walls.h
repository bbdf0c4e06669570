// Wall thickness of a part, sampled along lines through it.
#pragma once
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

struct WallSample {
  double thickness = 0;       // m
  double matter = 0;          // m^3, of the line's share of the part
  Vec3 where = Vec3::Zero();  // m, on the surface, where the line enters
};

// Along `lines` x `lines` lines over the part's bounding box in each of the three axes: the distance from
// where a line enters the part to where it leaves, times the cosine between line and normal, wherever the two
// normals oppose each other within 10 degrees. `mesh` is balanced and oriented.
[[nodiscard]] std::vector<WallSample> wall_samples(const PartMesh& mesh, int lines);

// Lines for each of `parts` parts: `lines`, and beyond 256 parts fewer, so that all together take no longer; at least 16.
[[nodiscard]] int wall_lines(int lines, std::size_t parts);

// m: about a fifth of `volume` [m^3] lies in walls that are thinner; infinite where no more is in any. A
// piece counts by the axis along which it is thinnest only where lines along the others find no wall.
[[nodiscard]] double fifth_wall(std::vector<WallSample> samples, double volume);

// Index of the thinnest sample; samples is not empty.
[[nodiscard]] std::size_t thinnest_sample(const std::vector<WallSample>& samples);

}  // namespace flexel::voxelize
