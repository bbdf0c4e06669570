// Hole filling and alpha wrapping by CGAL; only heal_cgal.cpp includes it.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// Triangles (indices into `loop`) that close a loop of points [m]; `across[i]` is the far corner of the
// triangle at edge (i, i + 1), which the patch should continue smoothly. Empty where there is none.
[[nodiscard]] std::vector<Corners> close_loop(const std::vector<Vec3>& loop, const std::vector<Vec3>& across);

// A closed surface around the triangles, from outside, through no opening narrower than `alpha` [m], `offset`
// [m] off them (Portaneri et al., "Alpha wrapping with an offset", 2022). Its triangles have no polygon. None
// where every triangle of the mesh is a line.
[[nodiscard]] PartMesh alpha_wrap(const PartMesh& mesh, double alpha, double offset);

// Rays against a mesh's triangles (world coordinates), which must stay.
class RayCaster {
 public:
  struct Hit {
    double distance = 0;  // m
    std::uint32_t triangle = 0;
  };
  explicit RayCaster(const PartMesh& mesh);
  ~RayCaster();
  // The first triangle but `own` that the ray meets.
  [[nodiscard]] std::optional<Hit> first(const Vec3& from, const Vec3& unit_direction,
                                         std::uint32_t own) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace flexel::voxelize
