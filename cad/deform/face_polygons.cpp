// A k-d tree (J. L. Bentley, 1975) a face, in one array.
#include "cad/deform/face_polygons.h"

#include <algorithm>

namespace flexel::cad {

FacePolygons::FacePolygons(const Body& body) {
  if (std::all_of(body.piece.begin(), body.piece.end(), [](std::uint16_t piece) { return piece == 0; }))
    return;
  const Surface& surface = body.surface;
  first_.assign(surface.faces.size() + 1, 0);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) ++first_[surface.polygon_face[p] + 1];
  for (std::size_t f = 0; f < surface.faces.size(); ++f) first_[f + 1] += first_[f];
  entries_.resize(surface.polygon_count());
  std::vector<std::size_t> next = first_;
  for (std::uint32_t p = 0; p < surface.polygon_count(); ++p) {
    Entry& entry = entries_[next[surface.polygon_face[p]]++];
    for (const std::uint32_t v : surface.polygon(p)) entry.middle += surface.vertices[v];
    entry.middle /= static_cast<double>(surface.polygon(p).size());
    entry.polygon = p;
  }
  for (std::size_t f = 0; f < surface.faces.size(); ++f) sort(first_[f], first_[f + 1], 0);
}

void FacePolygons::sort(std::size_t begin, std::size_t end, int axis) {
  if (end - begin < 2) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return entries_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end),
                   [axis](const Entry& a, const Entry& b) { return a.middle[axis] < b.middle[axis]; });
  sort(begin, middle, (axis + 1) % 3);
  sort(middle + 1, end, (axis + 1) % 3);
}

void FacePolygons::search(std::size_t begin, std::size_t end, int axis, const Vec3& x, Best& best) const {
  if (begin == end) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const Entry& entry = entries_[middle];
  if (const double distance = (entry.middle - x).squaredNorm(); distance < best.squared_distance)
    best = {distance, entry.polygon};
  const double beyond = x[axis] - entry.middle[axis];
  const int next = (axis + 1) % 3;
  beyond < 0 ? search(begin, middle, next, x, best) : search(middle + 1, end, next, x, best);
  if (beyond * beyond >= best.squared_distance) return;
  beyond < 0 ? search(middle + 1, end, next, x, best) : search(begin, middle, next, x, best);
}

std::optional<std::size_t> FacePolygons::nearest(std::size_t face, const Vec3& x) const {
  if (face + 1 >= first_.size() || first_[face] == first_[face + 1]) return std::nullopt;
  Best best;
  search(first_[face], first_[face + 1], 0, x, best);
  return best.polygon;
}

}  // namespace flexel::cad
