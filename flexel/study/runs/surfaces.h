// Distances between mapped surfaces.
#pragma once
#include <string>

#include "flexel/process/child.h"

namespace flexel::study {

// Distances of the mapped surface `path` from `finest` (both .ply of the same part, in mm): the root mean square, over
// the area, of the distance between the same material points, and the Hausdorff distance (hausdorff.h), computed
// until `deadline`. Throws InputError where the surfaces do not correspond.
struct SurfaceDistance {
  double rms = 0, hausdorff = 0;  // m
};
[[nodiscard]] SurfaceDistance surface_distance(const std::string& path, const std::string& finest,
                                               Deadline deadline);
// Writes `path` to `out` (.ply) with the distance of each vertex from `finest` as the attribute
// kErrorAttribute, in percent of `whole` [m].
inline constexpr const char* kErrorAttribute = "error_in_percent";
void write_error_surface(const std::string& path, const std::string& finest, double whole,
                         const std::string& out);

}  // namespace flexel::study
