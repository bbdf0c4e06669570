// Strains of all cells of a part, then differences to the next cell along each axis.
#include "simulate/matter/strain_jump.h"

#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace flexel::simulate {
namespace {

constexpr std::uint32_t kNoCell = ~0u;

struct Largest {
  double value = 0;
  Largest& operator+=(const Largest& other) {
    value = std::max(value, other.value);
    return *this;
  }
};

Mat3 strain_in_middle(const Body& body, const Part& part, const State& state, std::uint32_t cell) {
  const Vec3 quarter = (4 * part.lattice.spacing).cwiseInverse();
  Mat3 f = Mat3::Zero();  // of the displacement, in the axes of the lattice
  for (std::size_t a = 0; a < 8; ++a) {
    const Vec3 slope(a & 1 ? quarter.x() : -quarter.x(), a & 2 ? quarter.y() : -quarter.y(),
                     a & 4 ? quarter.z() : -quarter.z());
    f += part.lattice.axes.transpose() * state.displacement[body.cell_elements[cell][a]] * slope.transpose();
  }
  return 0.5 * (f + f.transpose() + f.transpose() * f);
}

// Whether `next` lies behind `cell` along the axis, with the four elements between them in common.
bool are_neighbours(const Body& body, std::uint32_t cell, std::uint32_t next, std::size_t bit) {
  for (std::size_t a = 0; a < 8; ++a)
    if (!(a & bit) && body.cell_elements[next][a] != body.cell_elements[cell][a | bit]) return false;
  return true;
}

double largest_jump(const Body& body, const Part& part, const State& state) {
  const std::size_t cells = part.cell_end - part.cell_begin;
  std::vector<Mat3> strain(cells);
  parallel_for_each(cells, [&](std::size_t c) {
    strain[c] = strain_in_middle(body, part, state, part.cell_begin + static_cast<std::uint32_t>(c));
  });
  std::vector<std::uint32_t> at_corner(part.element_end - part.element_begin, kNoCell);  // its lowest one
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
    if (!body.broken[c]) at_corner[body.cell_elements[c][0] - part.element_begin] = c;
  return parallel_sum<Largest>(
             cells,
             [&](std::size_t n) {
               const std::uint32_t c = part.cell_begin + static_cast<std::uint32_t>(n);
               Largest largest;
               if (body.broken[c]) return largest;
               for (std::size_t bit = 1; bit < 8; bit *= 2) {
                 const std::uint32_t next = at_corner[body.cell_elements[c][bit] - part.element_begin];
                 if (next == kNoCell || !are_neighbours(body, c, next, bit)) continue;
                 const double jump = (strain[next - part.cell_begin] - strain[n]).norm();
                 largest += {std::isfinite(jump) ? jump : std::numeric_limits<double>::infinity()};
               }
               return largest;
             })
      .value;
}

}  // namespace

std::vector<double> strain_jumps(const Body& body, const State& state) {
  std::vector<double> jumps;
  for (const Part& part : body.parts) jumps.push_back(largest_jump(body, part, state));
  return jumps;
}

}  // namespace flexel::simulate
