// How thick the walls of a part are, where lines through it tell.
#pragma once
#include "voxelize/part_mesh.h"

namespace flexel {

struct WallSample {
  double thickness = 0;       // m
  Vec3 where = Vec3::Zero();  // m, on the surface, where the line enters
};

// Along `lines` x `lines` lines over the part's bounding box in each of the three axes: the distance from
// where a line enters the part to where it leaves, times the cosine between line and normal, wherever the two
// normals oppose each other within 10 degrees. `mesh` is balanced and oriented.
[[nodiscard]] std::vector<WallSample> wall_samples(const PartMesh& mesh, int lines);

// Index of the thinnest sample; samples is not empty.
[[nodiscard]] std::size_t thinnest_sample(const std::vector<WallSample>& samples);

}  // namespace flexel
