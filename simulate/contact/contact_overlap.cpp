// Parts that begin inside each other: contact would throw them apart, or not see them at all where they are
// deeper in than it reaches. A point of one part's surface is inside another where, drawn in by a little, it
// lies in a whole cell of that; matter in cut cells is left alone.
//
// They are refused, or let out: every pair remembers how deep it began, and presses only beyond a share of
// that which falls from 1 to 0 along a cubic. What the contacts store grows by that beside the work of their
// forces; the books have it as work of "overlap".
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "formats/error.h"
#include "simulate/contact/contacts.h"

namespace flexel {
namespace {

constexpr double kBorne = 0.05;  // spacings
constexpr double kLookAt = 4;    // spacings, how deep is looked
constexpr double kLetOut = 0.9;  // spacings: nearly as deep as surfaces feel one another

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

// m, along the normal, looked for in steps of a tenth of a spacing and then halved; 0: outside. Of a ball,
// whose centre tells no more, its radius.
double depth_inside(const ContactPoint& point, const Vec3& at, const Lattice& lattice,
                    const WholeCells& cells) {
  const auto inside = [&](double depth) {
    const Vec3 place = lattice.to_lattice(at - depth * point.normal);
    const Index3 cell{static_cast<std::int32_t>(std::floor(place.x())),
                      static_cast<std::int32_t>(std::floor(place.y())),
                      static_cast<std::int32_t>(std::floor(place.z()))};
    return std::binary_search(cells.at.begin(), cells.at.end(), cell);
  };
  double in = kBorne * point.width * 1.01, out = in;
  if (!inside(in)) return 0;
  if (point.radius > 0) return point.radius;
  while (inside(out) && out < kLookAt * point.width) {
    in = out;
    out += 0.1 * point.width;
  }
  for (int halving = 0; halving < 20; ++halving) (inside(0.5 * (in + out)) ? in : out) = 0.5 * (in + out);
  return in;
}

[[noreturn]] void refuse_as_deep(const std::string& what, double depth) {
  throw InputError(
      "[contact]",
      fmt::format("{} by {:.3g} mm at the start: move them apart, bond them ([[bond]]), leave one "
                  "out of \"parts\", or give \"overlap\" = \"part\", which lets out up to {} cells",
                  what, 1e3 * depth, kLetOut));
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
  // By pair of parts the least: sides of what overlaps run along in the other.
  struct Depth {
    double depth = std::numeric_limits<double>::infinity(), width = 0;  // m
  };
  std::map<std::array<std::uint32_t, 2>, Depth> depths;
  for (const ContactPoint& point : points_) {
    const Vec3 at = position(point, state);
    if (!led(point.part))
      for (const ContactPlane& plane : settings_.planes)
        if (const double depth = point.radius - (at - plane.point).dot(plane.normal);
            depth > kBorne * point.width && !(settings_.parting > 0))
          refuse_as_deep(
              fmt::format("part \"{}\" begins inside {}", body_.parts[point.part].name, plane.name), depth);
    for (std::uint32_t other = 0; other < parts; ++other) {
      if (other == point.part || !settings_.parts[other] || moved[other] || cells[other].at.empty()) continue;
      if (led(point.part) && led(other)) continue;
      const double depth = depth_inside(point, at, body_.parts[other].lattice, cells[other]);
      Depth& least = depths[{std::min(point.part, other), std::max(point.part, other)}];
      if (depth > kBorne * point.width && depth < least.depth) least = {depth, point.width};
    }
  }
  for (const auto& [pair, least] : depths)
    if (std::isfinite(least.depth) && !(settings_.parting > 0 && least.depth <= kLetOut * least.width))
      refuse_as_deep(fmt::format("parts \"{}\" and \"{}\" overlap", body_.parts[pair[0]].name,
                                 body_.parts[pair[1]].name),
                     least.depth);
}

double Contacts::share_inside(const State& state) const {
  if (!(settings_.parting > 0)) return 1;
  const double passed = std::clamp(state.time.value_or(0) / settings_.parting, 0.0, 1.0);
  return 1 - passed * passed * (3 - 2 * passed);
}

// In the first look of a run, of the sides as they are then.
void Contacts::find_inside(const State& state) {
  if (!(settings_.parting > 0) || state.time.value_or(0) > 0) return;
  parallel_for_each(
      pairs_.size(),
      [&](std::size_t p) {
        const PairState now = state_of(p, 0);
        if (now.near && !now.deep) memory_[p].inside = std::max(-now.gap, 0.0);
      },
      512);
}

// What the fall of the share to `share` puts in: the mean of what presses before and after the step, as the
// books enter the work of forces.
void Contacts::book_letting_out(double share) {
  if (!(settings_.parting > 0) || share == share_) return;
  const double fell = std::exchange(share_, share) - share;
  double pressing = 0;  // J a share
  for (const std::uint32_t p : close_) pressing += states_[p].pressure * memory_[p].inside;
  put_in_ += 0.5 * fell * (std::exchange(pressing_, pressing) + pressing);
}

double Contacts::put_in(const State& state) {
  look(state);
  return std::exchange(put_in_, 0);
}

}  // namespace flexel
