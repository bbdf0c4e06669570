// The pieces of matter in one voxel that the surface passes through.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/disjoint_sets.h"
#include "voxelize/classify/clip.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// A voxel (i, j, k), its records and the winding number at its corners.
struct VoxelRecords {
  const PartMesh* mesh = nullptr;
  std::span<const Record> records;  // by triangle, one each
  int i = 0, j = 0, k = 0;
  std::array<int, 8> winding{};  // at corner a = di + 2 dj + 4 dk
};

struct VoxelPieces {
  static constexpr std::uint32_t kVoid = 0xffffffffu;
  std::uint32_t count = 1;
  std::vector<std::uint32_t> of_record;      // (records) piece that the record bounds; empty where count is 1
  std::array<std::uint32_t, 8> of_corner{};  // piece of each corner, kVoid where it is not solid
  std::uint32_t of_centre = kVoid;           // piece of the voxel's centre
  bool overlapping = false;  // shells intersect here, or matter lies inside matter: winding is not 0 or 1
  bool undecided = false;    // no way through the voxel was free of ties: taken as one piece
};

// Scratch memory that is reused from voxel to voxel.
struct PieceFinder {
  DisjointSets sets;
  std::vector<std::uint32_t> fragment;  // (records)
  std::vector<std::array<std::uint32_t, 2>> edge_records;
  VoxelPieces find(const VoxelRecords& voxel, bool with_centre);
};

// Winding number at `point` in the voxel, from that at a corner.
[[nodiscard]] int winding_at(const VoxelRecords& voxel, const Vec3& point);

}  // namespace flexel::voxelize
