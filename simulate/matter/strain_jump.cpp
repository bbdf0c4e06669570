// Strains of all cells of a part, then differences within each and to the next one along each axis.
#include "simulate/matter/strain_jump.h"

#include <algorithm>
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

// In the axes of the lattice.
struct CellStrain {
  Mat3 middle;
  double within = 0;  // the largest difference between the middles of two opposite faces
};

// The gradient is F in the middle of a cell and F + G or F - G in those of two opposite faces, for which
// Green's strain differs by F^T G + G^T F.
CellStrain strain_of(const Body& body, const Part& part, const State& state, std::uint32_t cell) {
  const auto sign = [](std::size_t corner, std::size_t axis) { return corner >> axis & 1 ? 1.0 : -1.0; };
  const Vec3 half = part.lattice.spacing / 2;
  Mat3 f = Mat3::Identity(), twist = Mat3::Zero();  // columns of `twist`: of y z, z x, x y
  for (std::size_t a = 0; a < 8; ++a) {
    const Vec3 u = part.lattice.axes.transpose() * state.displacement[body.cell_elements[cell][a]] / 8;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto column = static_cast<Eigen::Index>(axis);
      f.col(column) += sign(a, axis) / half[column] * u;
      twist.col(column) += sign(a, (axis + 1) % 3) * sign(a, (axis + 2) % 3) * u;
    }
  }
  CellStrain found{0.5 * (f.transpose() * f - Mat3::Identity())};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    Mat3 g = Mat3::Zero();
    const Eigen::Index next = (axis + 1) % 3, last = (axis + 2) % 3;
    g.col(next) = twist.col(last) / half[next];
    g.col(last) = twist.col(next) / half[last];
    const Mat3 product = f.transpose() * g;
    found.within = std::max(found.within, (product + product.transpose()).norm());
  }
  return found;
}

// Whether `next` lies behind `cell` along the axis, with the four elements between them in common.
bool are_neighbours(const Body& body, std::uint32_t cell, std::uint32_t next, std::size_t bit) {
  for (std::size_t a = 0; a < 8; ++a)
    if (!(a & bit) && body.cell_elements[next][a] != body.cell_elements[cell][a | bit]) return false;
  return true;
}

double largest_jump(const Body& body, const Part& part, const State& state) {
  const std::size_t cells = part.cell_end - part.cell_begin;
  std::vector<CellStrain> strain(cells);
  parallel_for_each(cells, [&](std::size_t c) {
    strain[c] = strain_of(body, part, state, part.cell_begin + static_cast<std::uint32_t>(c));
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
               const auto enter = [&](double jump) {
                 largest += {std::isfinite(jump) ? jump : std::numeric_limits<double>::infinity()};
               };
               enter(strain[n].within);
               for (std::size_t bit = 1; bit < 8; bit *= 2) {
                 const std::uint32_t next = at_corner[body.cell_elements[c][bit] - part.element_begin];
                 if (next == kNoCell || !are_neighbours(body, c, next, bit)) continue;
                 enter((strain[next - part.cell_begin].middle - strain[n].middle).norm());
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
