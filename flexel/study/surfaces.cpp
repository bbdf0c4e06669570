// Mapped surfaces against the finest one. All are the part's own mesh, moved: vertex i is the same material
// point in each, so no search is needed.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "flexel/study/study.h"
#include "formats/error.h"
#include "formats/import.h"
#include "formats/surface_file.h"

namespace flexel::study {
namespace {

Surface read(const std::string& path) {
  return import_surface(path);
}

std::vector<double> distances(const Surface& surface, const Surface& finest, const std::string& path) {
  if (surface.vertices.size() != finest.vertices.size())
    throw InputError(path, fmt::format("{} vertices, the finest surface has {}", surface.vertices.size(),
                                       finest.vertices.size()));
  std::vector<double> result(surface.vertices.size());
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = (surface.vertices[i] - finest.vertices[i]).norm();
  return result;
}

// A third of the area of the triangles around each vertex.
std::vector<double> vertex_areas(const Surface& surface) {
  std::vector<double> area(surface.vertices.size(), 0.0);
  for (const auto& [a, b, c] : triangulate(surface).corners) {
    const Vec3 ab = surface.vertices[b] - surface.vertices[a], ac = surface.vertices[c] - surface.vertices[a];
    const double third = ab.cross(ac).norm() / 6;
    for (const std::uint32_t corner : {a, b, c}) area[corner] += third;
  }
  return area;
}

}  // namespace

SurfaceDistance surface_distance(const std::string& path, const std::string& finest) {
  const Surface reference = read(finest);
  const std::vector<double> distance = distances(read(path), reference, path);
  const std::vector<double> area = vertex_areas(reference);
  SurfaceDistance result;
  double sum = 0, weight = 0;
  for (std::size_t i = 0; i < distance.size(); ++i) {
    sum += area[i] * distance[i] * distance[i];
    weight += area[i];
    if (area[i] > 0) result.largest = std::max(result.largest, distance[i]);
  }
  if (weight > 0) result.rms = std::sqrt(sum / weight);
  return result;
}

void write_error_surface(const std::string& path, const std::string& finest, double whole,
                         const std::string& out) {
  Surface surface = read(path);
  std::vector<double> error = distances(surface, read(finest), path);
  for (double& each : error) each *= 100 / whole;
  surface.vertex_columns = {{kErrorAttribute, {1, error}}};
  surface.sources.front().bytes.clear();  // a new file, not the old one with other positions
  surface.sources.front().format = "obj";
  const std::vector<Vec3> still(surface.vertices.size(), Vec3::Zero());
  write_surface(surface, still, SurfaceFormat::ply, 1e-3, out);
}

}  // namespace flexel::study
