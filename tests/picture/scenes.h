// Small parts to draw.
#pragma once
#include <cmath>
#include <map>
#include <numbers>

#include "flexel/picture/picture.h"
#include "flexel/picture/render/drawable.h"

namespace flexel::picture::test {

inline Surface surface_of(std::vector<Vec3> vertices,
                          const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  Surface surface;
  surface.vertices = std::move(vertices);
  surface.polygon_offsets = {0};
  for (const auto& triangle : triangles) {
    surface.polygon_vertices.insert(surface.polygon_vertices.end(), triangle.begin(), triangle.end());
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
  }
  surface.polygon_face.assign(triangles.size(), 0);
  surface.faces = {{"", 0}};
  surface.parts = {{"part"}};
  surface.sources.resize(1);
  surface.part_source = {0};
  return surface;
}

// An octahedron, split `splits` times, on a sphere.
inline Surface sphere(const Vec3& centre, double radius, int splits = 5) {
  std::vector<Vec3> points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<std::uint32_t, 3>> faces{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                  {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int s = 0; s < splits; ++s) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (fresh) points.push_back((points[a] + points[b]).normalized());
      return at->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = finer;
  }
  for (Vec3& p : points) p = centre + radius * p;
  return surface_of(points, faces);
}

inline Surface box(const Vec3& min, const Vec3& max) {
  std::vector<Vec3> corners;
  for (int c = 0; c < 8; ++c)
    corners.emplace_back((c & 1) != 0 ? max.x() : min.x(), (c & 2) != 0 ? max.y() : min.y(),
                         (c & 4) != 0 ? max.z() : min.z());
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const std::array<std::uint32_t, 4>& f : {std::array<std::uint32_t, 4>{0, 4, 6, 2},
                                                {1, 3, 7, 5},
                                                {0, 1, 5, 4},
                                                {2, 6, 7, 3},
                                                {0, 2, 3, 1},
                                                {4, 5, 7, 6}}) {
    triangles.push_back({f[0], f[1], f[2]});
    triangles.push_back({f[0], f[2], f[3]});
  }
  return surface_of(corners, triangles);
}

inline PictureSubject subject(Surface surface, const std::string& label = "part") {
  PictureSubject result;
  result.label = result.where = label;
  result.surface = std::move(surface);
  return result;
}

inline Image picture(const std::vector<PictureSubject>& subjects, const PictureOptions& options) {
  Progress progress("test", Progress::Mode::quiet);
  return draw_picture(subjects, options, progress).image;
}

}  // namespace flexel::picture::test
