// Bonds: parts that touch are held together where they do (docs/scene.md, "Parts that touch").
//
// At quadrature points q of the finer part's surface the same rest point is carried by a cell of either part
// with trilinear weights; the energy is 1/2 k_q |u_q - u'_q|^2, with k_q = 20 min(E / h, E' / h') times the
// point's area. Both sides reproduce affine displacements exactly, so that the bond resists no rotation, and
// the patch test holds across any two lattices. A bond yields like a twentieth of a cell more of the softer
// part; stiffer ones (300, as the ties to the ground) take four times the iterations and change a bar's end
// by 0.1
// %. One 16 x 16 matrix holds all the points of a pair of cells.
#pragma once
#include "simulate/effects/effect.h"

namespace flexel {

class Bonds {
 public:
  struct Parameters {
    bool bond = true;
  };
  static constexpr const char* name = "bonds";
  static constexpr double kPenalty = 20;  // stiffness per area, in E / h

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Bonds> make(const Parameters& parameters, const Setting& setting);
  [[nodiscard]] std::string why() const;

  [[nodiscard]] double energy(const State& state) const;
  void add_forces(const State& state, std::vector<Vec3>& forces) const;
  void add_stiffness(const State& state, const Stencil& stencil, const Body& body, BlockMatrix& matrix) const;
  [[nodiscard]] std::vector<CellPair> couples() const;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) const;

 private:
  struct BondedCells {
    CellPair cells;
    Eigen::Matrix<double, 16, 16> stiffness;  // N/m, elements of the first cell, then of the second
  };
  [[nodiscard]] std::uint32_t element(const BondedCells& bond, Eigen::Index a) const {
    return body_->cell_elements[bond.cells[static_cast<std::size_t>(a / 8)]][static_cast<std::size_t>(a % 8)];
  }
  [[nodiscard]] Eigen::Matrix<double, 16, 3> displacements(const BondedCells& bond, const State& state) const;

  const Body* body_ = nullptr;
  std::vector<BondedCells> cells_;  // ascending by the pair
  std::vector<BondedParts> parts_;  // who is bonded with whom
};

}  // namespace flexel
