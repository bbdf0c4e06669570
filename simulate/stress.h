// Stresses of a deformed body: Cauchy's, in the world frame [Pa].
//
// Of a cell: that of its matter at its mean deformation gradient, sigma = P F^T / J (model `cells`), or the
// mean over its springs, sigma = 1/V sum f (x) r (`springs`: the virial). A cell's middle is where the strain
// of a trilinear field is better by an order than elsewhere (Barlow 1976).
//
// Of an element: recovered from the cells around it (superconvergent patch recovery, Zienkiewicz and Zhu
// 1992): the mean of eight full cells, else the value there of a linear field fitted to the cells around and
// those next to them, weighted by fill and exp(-d^2 / h^2). So stresses at a part's surface are extrapolated
// over half a cell. Model `paper` has none.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "simulate/state.h"

namespace flexel {

using SymmetricStress = Eigen::Matrix<double, 6, 1>;  // xx, yy, zz, xy, yz, zx [Pa]

struct Stresses {
  std::vector<SymmetricStress> cell;     // (cells); 0 in broken and stray ones
  std::vector<SymmetricStress> element;  // (elements); 0 where no cell resists
};

// The stresses of the corner-placed parts.
[[nodiscard]] Stresses stresses(const Setting& setting, const State& state);

[[nodiscard]] double von_mises(const SymmetricStress& stress);  // Pa
// Descending.
[[nodiscard]] Vec3 principal_stresses(const SymmetricStress& stress);

// Where von Mises' stress is largest, over the elements of full cells (which lie in the matter or on its
// surface) and the middles of cells that are at least half full. Nothing where no cell resists.
struct LargestStress {
  double value = 0;        // Pa
  Vec3 at = Vec3::Zero();  // m, at rest
  std::uint32_t part = 0;
};
[[nodiscard]] std::optional<LargestStress> largest_stress(const Setting& setting, const Stresses& stresses);

// Columns "von_mises" [Pa] and "principal_stress" [Pa] (3, descending) of cells and elements.
void write_stress_columns(const Stresses& stresses, Body& body);
[[nodiscard]] bool is_stress_column(const std::string& name);
// Takes those of an earlier run away.
void erase_stress_columns(Body& body);

}  // namespace flexel
