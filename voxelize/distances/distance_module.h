// What the module flexel-distances.so gives, the one that has OpenVDB: loading that library takes longer than most parts
// need, so it is loaded where its distances are asked for (classify/sample_distances.cpp). C functions and plain types, so that
// the module has nothing else of ours in it.
#pragma once
#include <cstddef>
#include <cstdint>

extern "C" {

struct FlexelDistanceModule {
  // Distances from the points with whole coordinates to the nearest triangle, to `band` of them; negative for what a flood from
  // outside does not reach. `points`: (point_count x 3) in that unit; `corners`: (triangle_count x 3) indices. Null: no
  // memory.
  void* (*create)(const double* points, std::size_t point_count, const std::uint32_t* corners,
                  std::size_t triangle_count, float band);
  void (*destroy)(void* distances);
  // The size x size x size distances from (x, y, z) on, x fastest.
  void (*read)(const void* distances, int x, int y, int z, int size, float* out);
};

// The name of the module's one function, and its type.
#define FLEXEL_DISTANCE_MODULE flexel_distance_module
using FlexelDistanceModuleFunction = const FlexelDistanceModule*();
FlexelDistanceModuleFunction FLEXEL_DISTANCE_MODULE;
}
