// Parts that begin inside each other: contact would throw them apart, or not see them at all where they are
// deeper in than it reaches. A point of one part's surface is inside another where, drawn in by a little, it
// lies in a whole cell of that; matter in cut cells is left alone.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/error.h"
#include "simulate/contact/contacts.h"

namespace flexel {
namespace {

constexpr double kBorne = 0.05;  // spacings
constexpr double kLookAt = 4;    // spacings, how deep is looked

struct WholeCells {  // of a part, by their lowest corner, ascending
  std::vector<Index3> at;
};

WholeCells whole_cells(const Body& body, const Part& part) {
  WholeCells cells;
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
    if (body.fill[c] > 0.999) cells.at.push_back(body.lattice_index[body.cell_elements[c][0]]);
  std::sort(cells.at.begin(), cells.at.end());
  return cells;
}

}  // namespace

void Contacts::refuse_overlap(const State& state) const {
  const std::size_t parts = body_.parts.size();
  std::vector<WholeCells> cells;
  for (const Part& part : body_.parts) cells.push_back(whole_cells(body_, part));
  std::vector<std::uint8_t> moved(parts, 0);  // then its lattice does not tell where it is
  for (std::size_t p = 0; p < parts; ++p)
    for (std::uint32_t e = body_.parts[p].element_begin; e < body_.parts[p].element_end; ++e)
      moved[p] = moved[p] || state.displacement[e] != Vec3::Zero();
  double least = std::numeric_limits<double>::infinity();  // sides of what overlaps run along in the other
  std::string where;
  const auto found = [&](double depth, double width, const std::string& what) {
    if (!(depth > kBorne * width) || depth >= least) return;
    least = depth;
    where = what;
  };
  for (const ContactPoint& point : points_) {
    const Vec3 at = position(point, state);
    if (!led(point.part))
      for (const ContactPlane& plane : settings_.planes)
        found(point.radius - (at - plane.point).dot(plane.normal), point.width,
              fmt::format("part \"{}\" begins inside {}", body_.parts[point.part].name, plane.name));
    for (std::uint32_t other = 0; other < parts; ++other) {
      if (other == point.part || !settings_.parts[other] || moved[other] || cells[other].at.empty()) continue;
      if (led(point.part) && led(other)) continue;
      const Lattice& lattice = body_.parts[other].lattice;
      double depth = 0;
      for (double in = kBorne * point.width * 1.01; in < kLookAt * point.width; in += 0.1 * point.width) {
        const Vec3 place = lattice.to_lattice(at - in * point.normal);
        const Index3 cell{static_cast<std::int32_t>(std::floor(place.x())),
                          static_cast<std::int32_t>(std::floor(place.y())),
                          static_cast<std::int32_t>(std::floor(place.z()))};
        if (!std::binary_search(cells[other].at.begin(), cells[other].at.end(), cell)) break;
        depth = point.radius > 0 ? point.radius : in;
        if (point.radius > 0) break;
      }
      found(depth, point.width,
            fmt::format("parts \"{}\" and \"{}\" overlap", body_.parts[std::min(point.part, other)].name,
                        body_.parts[std::max(point.part, other)].name));
    }
  }
  if (!where.empty())
    throw InputError("[contact]", fmt::format("{} by {:.3g} mm at the start: move them apart, or bond them "
                                              "([[bond]]) or leave one out of \"parts\"",
                                              where, 1e3 * least));
}

}  // namespace flexel
