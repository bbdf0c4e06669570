// Brute force over the polygons of faces whose boxes overlap: done once, and faces of different parts rarely
// do.
#include "flexel/export/touching_faces.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "base/math/area_vector.h"
#include "base/math/distance.h"
#include "flexel/export/analysis.h"

namespace flexel::mesh_export {
namespace {

constexpr double kOpposed = -0.7;  // cosine between the normals

struct FacePolygons {
  std::vector<std::uint32_t> polygons;
  Box box;
};

bool overlap(const Box& a, const Box& b, double margin) {
  return (a.min.array() <= b.max.array() + margin).all() && (b.min.array() <= a.max.array() + margin).all();
}

// Whether the middle of a polygon of `f` lies on one of `g` that faces it.
bool touch(const Surface& surface, const FacePolygons& f, const FacePolygons& g, double tolerance) {
  for (const std::uint32_t p : f.polygons) {
    const auto corners = surface.polygon(p);
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t v : corners) middle += surface.vertices[v] / static_cast<double>(corners.size());
    Box at;
    at.add(middle);
    if (!overlap(at, g.box, tolerance)) continue;
    const Vec3 normal = area_vector(surface.vertices, corners).normalized();
    for (const std::uint32_t q : g.polygons) {
      const auto others = surface.polygon(q);
      if (!(normal.dot(area_vector(surface.vertices, others).normalized()) < kOpposed)) continue;
      for (std::size_t c = 1; c + 1 < others.size(); ++c)
        if (distance_to_triangle(middle, surface.vertices[others[0]], surface.vertices[others[c]],
                                 surface.vertices[others[c + 1]]) <= tolerance)
          return true;
    }
  }
  return false;
}

}  // namespace

std::vector<TiedFaces> touching_faces(const AnalysisMesh& mesh, double tolerance) {
  const Surface& surface = mesh.body.surface;
  std::vector<FacePolygons> faces(surface.faces.size());
  for (std::uint32_t p = 0; p < surface.polygon_count(); ++p) {
    FacePolygons& face = faces[surface.polygon_face[p]];
    face.polygons.push_back(p);
    for (const std::uint32_t v : surface.polygon(p)) face.box.add(surface.vertices[v]);
  }
  std::map<std::array<std::uint32_t, 2>, TiedFaces> found;
  for (std::uint32_t f = 0; f < faces.size(); ++f)
    for (std::uint32_t g = f + 1; g < faces.size(); ++g) {
      std::array<std::uint32_t, 2> part{surface.faces[f].part, surface.faces[g].part};
      std::array<std::uint32_t, 2> face{f, g};
      if (part[0] == part[1] || faces[f].polygons.empty() || faces[g].polygons.empty() ||
          !overlap(faces[f].box, faces[g].box, tolerance))
        continue;
      if (!touch(surface, faces[f], faces[g], tolerance) && !touch(surface, faces[g], faces[f], tolerance))
        continue;
      const auto spacing = [&](std::uint32_t p) { return mesh.body.parts[p].lattice.spacing.mean(); };
      // One order a pair, the finer lattice first.
      if (std::pair(spacing(part[1]), part[1]) < std::pair(spacing(part[0]), part[0])) {
        std::swap(part[0], part[1]);
        std::swap(face[0], face[1]);
      }
      TiedFaces& tie = found[part];
      tie.part = part;
      for (std::size_t side = 0; side < 2; ++side) {
        auto& list = tie.faces[side];
        if (std::find(list.begin(), list.end(), face[side]) == list.end()) list.push_back(face[side]);
      }
    }
  std::vector<TiedFaces> result;
  result.reserve(found.size());
  for (auto& [parts, tie] : found) result.push_back(std::move(tie));
  return result;
}

}  // namespace flexel::mesh_export
