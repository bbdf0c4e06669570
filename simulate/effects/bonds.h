// Bonds: parts that touch are held together where they do (docs/reference/scene.md, "Parts that touch").
//
// At quadrature points q of the finer part's surface the same rest point is carried by matter of either part:
// a cell with trilinear weights, or an element with its neighbours (simulate/matter/interpolation_weights.h); the energy is 1/2
// k_q |u_q - u'_q|^2, with k_q = 20 min(E / h, E' / h') times the point's area. Both sides reproduce affine
// displacements exactly, so that the bond resists no rotation, and the patch test holds across any two
// lattices. A bond yields like a twentieth of a cell more of the softer part; stiffer ones (300, as the ties
// to the ground) take four times the iterations and change a bar's end by 0.1
// %. One matrix holds all the points between the same carriers.
//
// Parts that joined in a timed run are left out (simulate/events/joined_bonds.h).
//
// In a timed run k_q is lowered, matrix by matrix, until its frequency squared is twice that of the cells:
// the step is cut by at most sqrt(3), and a bond yields like a fifth of a cell.
#pragma once
#include <array>

#include "simulate/effects/effect.h"
#include "simulate/matter/interface_points.h"

namespace flexel::simulate {

class Bonds : public Effect {
 public:
  struct Named {  // [[bond]]
    std::array<std::string, 2> parts;
    double gap = 0;  // m, over which they are bonded; 0: only where they touch
    std::string origin;
  };
  struct Parameters {
    bool bond = true;  // all parts that touch
    std::vector<Named> named;
  };
  static constexpr const char* name = "bonds";
  static constexpr double kPenalty = 20;  // stiffness per area, in E / h

  // (named) their parts, the lower number first. Throws InputError: no such part, or a gap wider than half a spacing.
  [[nodiscard]] static std::vector<TouchingGap> named_gaps(const Parameters& parameters, const Body& body);
  // Throws InputError: the parts do not touch.
  [[noreturn]] static void refuse_apart(const Named& named);
  // Throws InputError: one of them joined in an earlier run, and nothing holds it to the other.
  static void refuse_joined_apart(const Parameters& parameters, const Body& body);
  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Bonds> make(const Parameters& parameters, const Problem& problem);
  // Of what resists between elements: its row sums [N/m], by the elements.
  using Rows = std::vector<std::pair<std::uint32_t, double>>;
  // What is left of each in a timed run so that no element's rows together are stiffer than what is allowed times its
  // mass.
  [[nodiscard]] static std::vector<double> softening(const Problem& problem, const std::vector<Rows>& all);
  // Whether parts of these numbers are bonded with one another.
  [[nodiscard]] bool holds(std::uint32_t one, std::uint32_t other, const Body& body) const;
  [[nodiscard]] std::string why() const override;

  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::work; }
  [[nodiscard]] double added_frequency(const State&, const std::vector<double>&) override {
    return frequency_;
  }
  [[nodiscard]] double energy(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  void add_stiffness(const State& state, BlockMatrix& matrix) override;
  [[nodiscard]] std::vector<CoupledElements> couples() const override;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) override;

 private:
  struct BondedElements {
    std::vector<std::uint32_t> elements;  // of the first carrier, then of the second
    // N/m, in that order
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 16, 16> stiffness;
    [[nodiscard]] std::uint32_t element(Eigen::Index a) const {
      return elements[static_cast<std::size_t>(a)];
    }
  };
  using Displacements = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 16, 3>;
  [[nodiscard]] static Rows row_sums(const BondedElements& bond);
  void soften(const Problem& problem);
  [[nodiscard]] static Displacements displacements(const BondedElements& bond, const State& state);

  std::vector<BondedElements> bonds_;  // ascending by the elements
  std::vector<BondedParts> parts_;     // who is bonded with whom
  double frequency_ = 0;               // 1/s^2, in timed runs
};

}  // namespace flexel::simulate
