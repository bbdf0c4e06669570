// Stresses of a deformed body: Cauchy's, in the world frame [Pa].
//
// Of a cell: that of its matter at its mean deformation gradient, sigma = P F^T / J (model `cells`), or the
// mean over its springs, sigma = 1/V sum f (x) r (`springs`: the virial). A cell's middle is where the strain
// of a trilinear field is better by an order than elsewhere (Barlow 1976).
//
// Of an element: recovered from the cells around it (superconvergent patch recovery, Zienkiewicz and Zhu
// 1992): the mean of eight full cells, else the value of a linear field fitted to the cells around and those
// next to them, weighted by fill and exp(-d^2 / h^2), at the element; or, where the element lies outside the
// part (no cell around it is full), at the point of the part's surface nearest to it. So stresses at a part's
// surface are extrapolated over half a cell at most, and each is one of the part's matter. Model `paper` has
// none.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "simulate/state/state.h"

namespace flexel::simulate {

using SymmetricStress = Eigen::Matrix<double, 6, 1>;  // xx, yy, zz, xy, yz, zx [Pa]

struct Stresses {
  std::vector<SymmetricStress> cell;     // (cells); 0 in broken and stray ones
  std::vector<SymmetricStress> element;  // (elements); 0 where no cell resists
  std::vector<Vec3> element_at;          // (elements) m, the point of the matter that it is of, at rest
  // Of model `quadratic`; else none:
  std::vector<SymmetricStress> vertex;  // (vertices of the surface)
  // (elements) Pa, von Mises stress of how far the field of one cell is from what the cells around say together
  std::vector<double> element_doubt;
};

// The stresses of the corner-placed parts.
[[nodiscard]] Stresses stresses(const Problem& problem, const State& state);

[[nodiscard]] double von_mises(const SymmetricStress& stress);  // Pa
// Descending.
[[nodiscard]] Vec3 principal_stresses(const SymmetricStress& stress);

// The largest von Mises stress of the part's matter: of Stresses::element. Nothing where no cell resists.
struct LargestStress {
  double value = 0;        // Pa
  Vec3 at = Vec3::Zero();  // m, at rest
  std::uint32_t part = 0;
  double doubt = 0;  // Pa, Stresses::element_doubt
};
[[nodiscard]] std::optional<LargestStress> largest_stress(const Body& body, const Stresses& stresses);

// Columns "von_mises" [Pa] and "principal_stress" [Pa] (3, descending) of the elements, whose largest is
// largest_stress(); of the cells "cell_von_mises" and "cell_principal_stress", in the middle of each; and of the
// surface's vertices, where they are known, as of the elements.
void write_stress_columns(const Stresses& stresses, Body& body);
[[nodiscard]] bool is_stress_column(const std::string& name);
// Takes those of an earlier run away, the surface's only where the elements have them too: else they are the part's own.
void erase_stress_columns(Body& body);

}  // namespace flexel::simulate
