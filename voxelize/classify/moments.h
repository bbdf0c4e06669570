// Exact moments (formats/lattice/cell_moments.h) of the pieces of a voxel, from the polygons that bound them.
#pragma once
#include <array>
#include <vector>

#include "formats/lattice/cell_moments.h"
#include "voxelize/classify/pieces.h"
#include "voxelize/classify/voxels.h"

namespace flexel::voxelize {

// The integrals of L_0 .. L_4 from x to 1.
[[nodiscard]] std::array<double, kMomentPoints> lagrange_tails(double x);

// Sums up what the clipped polygons around one piece say of its moments; see moments.cpp.
class MomentSum {
 public:
  // A polygon of the piece, clipped to voxel (i, j, k).
  void add(const Polygon& polygon, const Index3& voxel);
  // Once all are added; `winding` is the piece's number at the voxel's lowest corner.
  [[nodiscard]] CellMoments total(int winding) const;

 private:
  CellMoments inside_{};                                      // polygon terms
  std::array<double, kMomentPoints * kMomentPoints> face_{};  // i + 5 j: side terms, without w_l
  std::array<double, kMomentPoints> edge_{};                  // crossing terms, without w_j w_l
};

// Appends those of a piece, if the surface cuts it: faces on lattice planes leave nothing, or all.
void append_moments(const CellMoments& moments, std::uint32_t piece, Slab& slab);

// Finds the moments of pieces; keeps its memory from voxel to voxel.
class MomentFinder {
 public:
  // Appends to the slab the moments of those of the voxel's pieces, from `first` on, that the surface cuts. A
  // piece gets none where they do not add up to its fill: a shell passes through itself there.
  void find(const VoxelRecords& voxel, const VoxelPieces& found, std::uint32_t first, Slab& slab);

 private:
  std::vector<MomentSum> sums_;
};

}  // namespace flexel::voxelize
