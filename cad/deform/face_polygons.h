// Which polygon of a face's mesh a point is at: it tells on which of two close walls the point is.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::cad {

class FacePolygons {
 public:
  // Empty where no two cells of the body are at one place of the lattice: there a point's place tells its wall.
  explicit FacePolygons(const Body& body);

  // The polygon of face `face` (index into Surface::faces) whose middle is nearest to `x` (m, at rest); nothing of a face
  // without polygons.
  [[nodiscard]] std::optional<std::size_t> nearest(std::size_t face, const Vec3& x) const;

 private:
  struct Entry {
    Vec3 middle = Vec3::Zero();
    std::uint32_t polygon = 0;
  };
  struct Best {
    double squared_distance = 1e300;  // m^2
    std::uint32_t polygon = 0;
  };
  void sort(std::size_t begin, std::size_t end, int axis);
  void search(std::size_t begin, std::size_t end, int axis, const Vec3& x, Best& best) const;

  std::vector<std::size_t> first_;  // (faces + 1) entries of each
  std::vector<Entry> entries_;      // those of a face: a k-d tree, the middle one divides, axes in turn
};

}  // namespace flexel::cad
