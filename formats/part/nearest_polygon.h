// The polygon of a surface at rest that is nearest to a point.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>

#include "base/math/vec.h"
#include "formats/part/surface.h"

namespace flexel {

struct NearPolygon {
  std::uint32_t polygon = 0;
  Vec3 at = Vec3::Zero();  // m, the point of it that is nearest
  double distance = 0;     // m
  bool outside = false;    // the point that was asked about lies on the side that the polygon's normal shows
};

// A tree of boxes around the surface's triangles. Keeps a reference to the surface.
class NearestPolygon {
 public:
  // `points`: as many as will be asked about. For a few all triangles are looked at, which takes less than the tree does.
  explicit NearestPolygon(const Surface& surface, std::size_t points = SIZE_MAX);

  // Of the polygons that count. Distances that differ by less than `same` [m] are one: of polygons that touch one
  // on whose inner side the point lies is taken. Nothing where none counts.
  [[nodiscard]] std::optional<NearPolygon> find(
      const Vec3& point, double same, const std::function<bool(std::uint32_t polygon)>& counts) const;

 private:
  struct Box {
    Vec3 low, high;           // m
    std::uint32_t begin = 0;  // of its triangles in order_
    std::uint32_t end = 0;
    std::uint32_t second = 0;  // of its two halves; the first follows the box. 0: not halved
  };
  struct Best {
    double rank = 0;
    std::optional<NearPolygon> found;
  };
  void halve(std::uint32_t begin, std::uint32_t end, std::uint32_t few);
  void look_into(std::uint32_t box, const Vec3& point, double same,
                 const std::function<bool(std::uint32_t)>& counts, Best& best) const;
  void consider(std::uint32_t triangle, const Vec3& point, double same, Best& best) const;
  [[nodiscard]] const Vec3& corner(std::uint32_t triangle, std::size_t which) const {
    return surface_.vertices[triangles_.corners[triangle][which]];
  }

  const Surface& surface_;
  Triangles triangles_;
  std::vector<std::uint32_t> order_;  // triangles, by box
  std::vector<Box> boxes_;
};

}  // namespace flexel
