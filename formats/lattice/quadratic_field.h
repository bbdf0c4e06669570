// The displacement field of model `quadratic`: 27 nodes a cell, which travel in a body as a column of its cells.
//
// Node n = i + 3 j + 9 k of a cell lies at (i, j, k) / 2 of its own coordinates [0, 1]^3. Those with i, j and k
// even are the cell's elements; the other 19 have their displacement [m, world frame] in the column
// "quadratic_displacement" (57 components), in ascending order of n, the same values in every cell that shares
// them.
#pragma once
#include <array>
#include <cstdint>

#include "formats/lattice/body.h"

namespace flexel {

constexpr std::size_t kQuadraticNodes = 27;
constexpr std::size_t kBetweenNodes = 19;  // those that are no elements
constexpr const char* kQuadraticColumn = "quadratic_displacement";

// The triquadratic shape functions at `at` (cell coordinates), and their gradients there (by cell coordinates).
struct QuadraticShape {
  std::array<double, kQuadraticNodes> value{};
  std::array<Vec3, kQuadraticNodes> gradient{};
};
[[nodiscard]] QuadraticShape quadratic_shape(const Vec3& at);

// The element of a cell (0 to 7) that node n is; 8 for the nodes between.
[[nodiscard]] constexpr std::size_t corner_of_node(std::size_t n) {
  const std::size_t i = n % 3, j = n / 3 % 3, k = n / 9;
  return i == 1 || j == 1 || k == 1 ? 8 : i / 2 + j + 2 * k;
}
[[nodiscard]] constexpr std::size_t node_of_corner(std::size_t corner) {
  return 2 * (corner & 1) + 6 * (corner >> 1 & 1) + 18 * (corner >> 2);
}

// Of trilinear interpolation from the cell's elements: the weight of element `corner` at node n.
[[nodiscard]] constexpr double trilinear_weight(std::size_t n, std::size_t corner) {
  double weight = 1;
  for (std::size_t axis = 0, at = n; axis < 3; ++axis, at /= 3)
    weight *= at % 3 == 1 ? 0.5 : at % 3 / 2 == (corner >> axis & 1) ? 1 : 0;
  return weight;
}

// Coordinates of a rest point (m, world frame) in a cell: [0, 1]^3 inside.
[[nodiscard]] Vec3 cell_coordinates(const Body& body, const Part& part, std::uint32_t cell,
                                    const Vec3& point);

// Reads the field of a body that has it. Keeps references.
class QuadraticField {
 public:
  // Nothing of a body without the column (or with one of a wrong size).
  [[nodiscard]] static bool is_in(const Body& body);
  // `displacement`: (elements x 3) m.
  QuadraticField(const Body& body, const std::vector<Vec3>& displacement);

  [[nodiscard]] std::array<Vec3, kQuadraticNodes> nodes(std::uint32_t cell) const;  // m
  // Displacement [m] at cell coordinates `at`.
  [[nodiscard]] Vec3 displacement(std::uint32_t cell, const Vec3& at) const;

 private:
  const Body& body_;
  const std::vector<Vec3>& displacement_;
  const std::vector<double>& between_;
};

}  // namespace flexel
