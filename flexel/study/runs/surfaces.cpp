// Distances of mapped surfaces from the finest one. All are the part's mesh, deformed: vertex i is the same
// material point in each.
#include "flexel/study/runs/surfaces.h"
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "flexel/study/runs/hausdorff.h"
#include "formats/exchange/import.h"
#include "formats/exchange/surface_file.h"

namespace flexel::study {
namespace {

// In mm, whatever the part's file is in.
Surface read(const std::string& path) {
  ImportOptions options;
  options.unit = 1e-3;
  return import_surface(path, options);
}

void check_same_mesh(const Surface& surface, const Surface& finest, const std::string& path) {
  if (surface.vertices.size() != finest.vertices.size() ||
      surface.polygon_vertices != finest.polygon_vertices)
    throw InputError(path, fmt::format("{} vertices, the finest surface has {}: large triangles are split as "
                                       "each run bends them; --edge LENGTH splits them alike, before",
                                       surface.vertices.size(), finest.vertices.size()));
}

}  // namespace

// The difference d is linear over a triangle of corners i: the integral of |d|^2 is the area times
// (|d1|^2 + |d2|^2 + |d3|^2 + |d1 + d2 + d3|^2) / 12.
SurfaceDistance surface_distance(const std::string& path, const std::string& finest, Deadline deadline) {
  const Surface reference = read(finest), surface = read(path);
  check_same_mesh(surface, reference, path);
  const auto triangles = triangulate(reference).corners;
  double integral = 0, area = 0;
  for (const auto& [a, b, c] : triangles) {
    const Vec3 &at = reference.vertices[a], ab = reference.vertices[b] - at, ac = reference.vertices[c] - at;
    const double part = ab.cross(ac).norm() / 2;
    Vec3 sum = Vec3::Zero();
    double squares = 0;
    for (const std::uint32_t corner : {a, b, c}) {
      const Vec3 difference = surface.vertices[corner] - reference.vertices[corner];
      sum += difference;
      squares += difference.squaredNorm();
    }
    integral += part * (squares + sum.squaredNorm()) / 12;
    area += part;
  }
  SurfaceDistance result;
  if (area > 0) result.rms = std::sqrt(integral / area);
  result.hausdorff = hausdorff_distance(surface.vertices, reference.vertices, triangles, deadline);
  return result;
}

void write_error_surface(const std::string& path, const std::string& finest, double whole,
                         const std::string& out) {
  Surface surface = read(path);
  const Surface reference = read(finest);
  check_same_mesh(surface, reference, path);
  std::vector<double> error(surface.vertices.size());
  for (std::size_t v = 0; v < error.size(); ++v)
    error[v] = 100 * (surface.vertices[v] - reference.vertices[v]).norm() / whole;
  surface.vertex_columns = {{kErrorAttribute, {1, error}}};
  surface.sources.front().bytes.clear();  // a new file, not the old one with other positions
  surface.sources.front().format = "obj";
  const std::vector<Vec3> still(surface.vertices.size(), Vec3::Zero());
  write_surface(surface, still, surface_format("ply"), 1e-3, out);
}

}  // namespace flexel::study
